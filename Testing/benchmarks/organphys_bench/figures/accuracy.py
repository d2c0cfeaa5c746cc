"""Target registration error (TRE) against the truth, mm."""

from __future__ import annotations

import numpy as np

from organphys.ground.checks import Array
from organphys.ground.frames import fit_similarity
from organphys.pipeline.evaluation import REGIONS, Truth, errors_mm


def tre_figures(truth: Truth, mapped: Array) -> dict[str, dict[str, float]]:
    """{"all", "visible", "hidden", "interior": {mean, median, p95, max}} in mm of mapped points (N, 3), scene."""
    error = errors_mm(truth, mapped)
    chosen = {"all": np.ones(len(error), bool), **{name: truth.region == k for k, name in enumerate(REGIONS)}}
    return {name: _summary(error[rows]) for name, rows in chosen.items() if rows.any()}


def oracle_mean_mm(truth: Truth) -> float:
    """Mean TRE in mm of the least-squares best similarity: what no rigid registration with scale beats in rms."""
    best = fit_similarity(truth.points_ct, truth.points_scene)
    return float(errors_mm(truth, best.apply(truth.points_ct)).mean())


def _summary(error: Array) -> dict[str, float]:
    return {
        "mean": float(error.mean()),
        "median": float(np.median(error)),
        "p95": float(np.percentile(error, 95)),
        "max": float(error.max()),
    }
