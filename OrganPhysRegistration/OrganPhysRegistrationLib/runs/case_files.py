"""Files shared with the child: what goes in and what comes out, in steps."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from organphys.points.point_sets import Landmarks

from .gathered_case import GatheredCase, gather
from .run_inputs import RunInputs
from .warm_session import case_digest


@dataclass(frozen=True)
class SavedCase:
    """file: name of the case file in the shared folder; digest: fingerprint of its content; landmarks: those in it."""

    file: str
    digest: str
    landmarks: Landmarks | None = None


def save_case_steps(inputs: RunInputs, folder: Path) -> Generator[None, None, SavedCase]:
    """Read the nodes and write the case file; InputError says what is wrong with one of them."""
    case = yield from gather(inputs)
    yield
    digest = case_digest(case)
    yield
    return SavedCase(_save(case, folder), digest, case.landmarks)


def outcome_steps(folder: Path) -> Generator[None, None, Any]:
    """The CaseOutcome that the child has left in ``folder``."""
    from organphys.pipeline.outcome_files import load_outcome

    yield
    return load_outcome(folder)


def _save(case: GatheredCase, folder: Path) -> str:
    from organphys.pipeline.outcome_files import save_case

    return save_case(
        folder,
        mask=case.segment.mask,
        ijk_to_ras=case.segment.ijk_to_ras,
        name=case.segment.name,
        splat=case.splat,
        options=SimpleNamespace(**case.settings),  # RegisterOptions would import scipy, which holds Slicer's window
        landmarks=case.landmarks,
        camera=case.camera,
        box=case.box,
        unit=case.unit,
        opening=case.opening,
        close_holes=case.close_holes,
        provenance=case.provenance,
    )
