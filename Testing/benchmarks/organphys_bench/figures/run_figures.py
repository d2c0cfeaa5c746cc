"""All figures of one finished registration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from organphys.ground.checks import Array
from organphys.pipeline.evaluation import Truth, errors_mm
from organphys.points.point_sets import Organ
from organphys.points.sampling import random_subset

from ..problem.outcome import Outcome
from ..problem.thin_surface import thinned
from .accuracy import oracle_mean_mm, tre_figures
from .deformation import deformation_figures
from .residuals import SURFACE_POINTS, residual_figures

PICTURE_VERTICES = 1500


def run_figures(outcome: Outcome, organ: Organ, target: Array, truth: Truth, *, seed: int) -> dict[str, Any]:
    """JSON values; ``target`` (M, 3): the splat points all methods are measured to, scene units."""
    tre = tre_figures(truth, outcome.map_points(truth.points_ct))
    oracle = oracle_mean_mm(truth)
    boundary = organ.boundary_points
    boundary = boundary[random_subset(len(boundary), SURFACE_POINTS, seed)]

    def residuals(map_points: Callable[[Array], Array]) -> dict[str, float]:
        return residual_figures(boundary, map_points(boundary), target, mm_per_unit=truth.mm_per_unit)

    return {
        "tre_mm": tre,
        "oracle_mm": oracle,
        "ratio_to_oracle": tre["all"]["mean"] / oracle,
        "scale_error_percent": 100 * (outcome.T_scene_ct.scale * truth.mm_per_unit - 1),
        "residuals": residuals(outcome.map_points),
        "stages": {
            name: {"tre_mm": tre_figures(truth, pose.apply(truth.points_ct)), "residuals": residuals(pose.apply)}
            for name, pose in outcome.stages.items()
        },
        "deformation": deformation_figures(outcome.map_points, outcome.T_scene_ct, organ.volume_points, seed=seed),
        "points": {"ct_surface": len(boundary), "splat": len(target)},
    }


def picture_data(outcome: Outcome, organ: Organ, truth: Truth) -> dict[str, Any]:
    """The mapped surface, thinned, with the TRE in mm near every vertex (means of the four nearest truth points)."""
    vertices, faces = thinned(organ, PICTURE_VERTICES)
    surface = truth.region < 2
    error = errors_mm(truth, outcome.map_points(truth.points_ct))[surface]
    near = cKDTree(truth.points_ct[surface]).query(vertices, k=min(4, int(surface.sum())))[1]
    scene = outcome.map_points(vertices)
    return {
        "vertices_scene": np.round(scene, 5).tolist(),
        "faces": faces.tolist(),
        "error_mm": np.round(error[near.reshape(len(vertices), -1)].mean(1), 2).tolist(),
    }
