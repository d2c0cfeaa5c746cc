"""A run's outcome into the scene, in steps: first what is seen, then the elastic transforms."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..outputs.case_nodes import CaseNodes, write_grids, write_outcome
from ..outputs.surface_nodes import SurfaceNormals
from ..outputs.undo import RunUndo, begin_run
from .case_files import outcome_steps
from .run_inputs import RunInputs


@dataclass(frozen=True)
class WrittenCase:
    """The case's nodes, and how to put the scene back to what it was before they were written."""

    case: CaseNodes
    undo: RunUndo


def result_steps(folder: Path, inputs: RunInputs) -> Generator[None, None, WrittenCase]:
    """Load the outcome in ``folder`` and write it, whole or not at all; given up after that, it is undone."""
    written = yield from case_steps(folder, inputs)
    try:
        yield  # whoever is told of the result has a turn of the event loop of its own
    except GeneratorExit:
        if written.undo.possible:
            written.undo.undo()
        raise
    return written


def case_steps(folder: Path, inputs: RunInputs) -> Generator[None, None, WrittenCase]:
    """Load the outcome in ``folder`` and write it into the case of segment and splat, or into a new one; the last step
    does all that changes the scene."""
    outcome = yield from outcome_steps(folder)
    yield
    normals = SurfaceNormals.of(outcome)
    yield
    return write_case(outcome, inputs, normals)


def write_case(outcome: Any, inputs: RunInputs, normals: SurfaceNormals | None = None) -> WrittenCase:
    """Write a CaseOutcome into the case of segment and splat, or into a new one; ``normals``: see ``write_outcome``."""
    undo = begin_run(inputs.segmentation, inputs.segment_id, inputs.splat)
    case = write_outcome(
        outcome,
        segmentation=inputs.segmentation,
        segment_id=inputs.segment_id,
        splat=inputs.splat,
        case_id=undo.case_id,
        normals=normals,
    )
    return WrittenCase(case, undo)


def transform_steps(folder: Path, case: CaseNodes) -> Generator[None, None, None]:
    """Make the case's transforms elastic from the grids of the outcome in ``folder``; InputError if it was deleted."""
    outcome = yield from outcome_steps(folder)
    yield
    write_grids(case, outcome.grids)
