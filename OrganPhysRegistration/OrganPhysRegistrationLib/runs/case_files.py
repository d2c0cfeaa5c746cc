"""Files shared with the child: what goes in, in steps, and what comes out."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .gathered_case import gather
from .run_inputs import RunInputs
from .warm_session import case_digest


@dataclass(frozen=True)
class SavedCase:
    """file: name of the case file in the shared folder; digest: fingerprint of all that is in it."""

    file: str
    digest: str


def save_case_steps(inputs: RunInputs, folder: Path) -> Generator[None, None, SavedCase]:
    """Read the nodes and write the case file; InputError says what is wrong with one of them."""
    from organphys.pipeline.outcome_files import save_case

    case = yield from gather(inputs)
    yield
    digest = case_digest(case)
    yield
    ...


def outcome_steps(folder: Path) -> Generator[None, None, Any]:
    """The CaseOutcome that the child has left in ``folder``."""
    from organphys.pipeline.outcome_files import load_outcome

    yield
    return load_outcome(folder)
