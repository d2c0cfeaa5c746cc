"""How far a registration is from a known truth: target registration error (TRE) in mm."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError, as_points
from ..ground.frames import fit_similarity

REGIONS = ("visible", "hidden", "interior")


@dataclass(frozen=True)
class Truth:
    """points_ct (N, 3) RAS mm, their true places points_scene (N, 3), region (N,): 0 visible, 1 hidden surface,
    2 interior; mm per scene unit."""

    points_ct: Array
    points_scene: Array
    region: NDArray[np.integer]
    mm_per_unit: float


def read_truth(path: str | Path) -> Truth:
    """The truth.npz of a case; a registration must never read it."""
    try:
        with np.load(path, allow_pickle=False) as data:
            return Truth(data["points_ct"], data["points_scene"], data["region"], float(data["mm_per_unit"]))
    except KeyError as error:
        raise InputError(f"{path}: not the truth of a case, {error.args[0]}") from error


def errors_mm(truth: Truth, mapped: Array) -> Array:
    """TRE (N,) in mm of mapped points (N, 3) in scene units; a point that is not finite counts as infinite."""
    mapped = np.asarray(mapped, dtype=np.float64)
    if mapped.shape != truth.points_scene.shape:
        raise InputError(f"mapped points: expected shape {truth.points_scene.shape}, got {mapped.shape}")
    error = np.linalg.norm(mapped - truth.points_scene, axis=1) * truth.mm_per_unit
    return np.where(np.isfinite(error), error, np.inf)


def mean_by_region(truth: Truth, mapped: Array) -> dict[str, float]:
    """Mean TRE in mm over all points ("all") and over each region that has points."""
    error = errors_mm(truth, mapped)
    means = {"all": float(error.mean())}
    for number, name in enumerate(REGIONS):
        chosen = truth.region == number
        if chosen.any():
            means[name] = float(error[chosen].mean())
    return means


def oracle_by_region(truth: Truth) -> dict[str, float]:
    """Mean TRE in mm of the least-squares best similarity over all true points: no rigid registration with scale
    has a lower root mean square."""
    best = fit_similarity(as_points(truth.points_ct), as_points(truth.points_scene))
    return mean_by_region(truth, best.apply(truth.points_ct))
