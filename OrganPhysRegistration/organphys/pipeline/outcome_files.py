"""A case and its outcomes on disk, for another process: one file each, of plain arrays and one JSON text, no pickle.

Each file is written whole or not at all, and nothing in it is believed unchecked (see ``asset/array_archive.py``).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..asset.array_archive import archive_bytes, read_archive
from ..exports.grid_records import DisplacementGrid, DisplacementGrids
from ..ground.atomic_file import write_bytes
from ..ground.checks import InputError
from ..readers.plain_numbers import plain_numbers
from .case_file import save_case
from .case_outcome import CaseOutcome
from .outcome_checks import check_outcome

__all__ = ["load_outcome", "save_case", "save_outcome"]

OUTCOME, HEADER = "outcome.npz", "outcome.json"
CONFIDENCE = ("error_68_mm", "error_95_mm")
ARRAYS = (
    "vertices_ct",
    "faces",
    "camera_position",
    "displacement_mm",
    "det_f",
    "volume_ct",
    "volume_scene",
    *CONFIDENCE,
)
BY_STAGE = ("similarities", "surfaces", "distance_mm")
GRIDS = ("forward", "inverse")
GRID_ERRORS = ("error_mm", "error_outside_mm", "linear_error_mm")


def save_outcome(outcome: CaseOutcome, folder: str | os.PathLike[str]) -> None:
    """Write ``folder``/outcome.npz, atomically; the folder is made if it is missing."""
    values = {field.name: getattr(outcome, field.name) for field in fields(outcome)}
    arrays = {name: values.pop(name) for name in ARRAYS}
    arrays = {name: value for name, value in arrays.items() if value is not None}
    arrays["faces"] = np.asarray(outcome.faces, dtype=np.int32)
    for name in BY_STAGE:
        arrays |= {f"{name}/{stage}": value for stage, value in values.pop(name).items()}
    asset, grids = values.pop("asset"), values.pop("grids")
    if asset is not None:
        arrays["asset"] = np.frombuffer(asset, dtype=np.uint8)
    if grids is not None:
        values["grids"] = {name: _grid_facts(getattr(grids, name)) for name in GRIDS}
        arrays |= {f"grids/{name}": np.asarray(getattr(grids, name).vectors, dtype=np.float32) for name in GRIDS}
    write_bytes(Path(folder) / OUTCOME, archive_bytes(HEADER, values, arrays, sort_keys=False))


def load_outcome(folder: str | os.PathLike[str]) -> CaseOutcome:
    """The outcome that ``save_outcome`` left; InputError where it is missing or damaged."""
    path = Path(folder) / OUTCOME
    header, arrays = read_archive(path, HEADER)
    try:
        outcome = _outcome(header, arrays)
        check_outcome(outcome)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"{path}: damaged ({error}); run the registration again") from error
    return outcome


def _outcome(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> CaseOutcome:
    values = dict(header)
    stages = [stage for stage in ("before", "coarse", "rigid", "elastic") if f"similarities/{stage}" in arrays]
    values |= {name: {stage: arrays[f"{name}/{stage}"] for stage in stages} for name in BY_STAGE}
    values |= {name: arrays[name] for name in ARRAYS if name in arrays}
    values["notices"] = tuple((str(code), str(message)) for code, message in header["notices"])
    values["steps"] = tuple(header["steps"])
    if "asset" in arrays:
        values["asset"] = arrays["asset"].tobytes()
    if "grids" in header:
        grids = (_grid(header["grids"][name], arrays[f"grids/{name}"]) for name in GRIDS)
        values["grids"] = DisplacementGrids(*grids)
    return CaseOutcome(**values)


def _grid_facts(grid: DisplacementGrid) -> dict[str, Any]:
    return {name: getattr(grid, name) for name in ("origin", "spacing", *GRID_ERRORS)}


def _grid(facts: Mapping[str, Any], vectors: np.ndarray) -> DisplacementGrid:
    if vectors.ndim != 4 or vectors.shape[3] != 3:
        raise ValueError(f"grid vectors: shape {vectors.shape}, expected (K, J, I, 3)")
    origin, spacing = (plain_numbers(facts[name], 3, f"grid {name}") for name in ("origin", "spacing"))
    if (spacing <= 0).any():
        raise ValueError("grid spacing is not above 0")
    return DisplacementGrid(origin, spacing, vectors, **{name: dict(facts[name]) for name in GRID_ERRORS})
