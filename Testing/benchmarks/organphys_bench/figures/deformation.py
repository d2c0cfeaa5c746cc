"""Volume change and strain of a registration inside the organ, from differences of the map itself."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from organphys.align.metrics import strain_percentiles
from organphys.ground.checks import Array
from organphys.ground.frames import Similarity
from organphys.points.sampling import random_subset

POINTS, HALF_STEP_MM = 2000, 0.25
PERCENTILES = (5.0, 50.0, 95.0)


def deformation_figures(
    map_points: Callable[[Array], Array], T_scene_ct: Similarity, volume_points: Array, *, seed: int = 0
) -> dict[str, float | dict[str, float]]:
    """Volume drift 100 (mean det F - 1), range of det F, percentiles of the largest and smallest principal stretch.

    F is the deformation beyond ``T_scene_ct``, at up to 2000 of ``volume_points`` (N, 3), RAS mm.
    """
    points = volume_points[random_subset(len(volume_points), POINTS, seed)]
    gradients = map_gradients(map_points, T_scene_ct, points)
    determinants = np.linalg.det(gradients)
    stretches = strain_percentiles(gradients, PERCENTILES)
    return {
        "volume_drift_percent": 100 * float(determinants.mean() - 1),
        "min_det_f": float(determinants.min()),
        "max_det_f": float(determinants.max()),
        **{
            name: {f"p{p:.0f}": float(v) for p, v in zip(PERCENTILES, values, strict=True)}
            for name, values in stretches.items()
        },
    }


def map_gradients(map_points: Callable[[Array], Array], T_scene_ct: Similarity, points: Array) -> Array:
    """F (N, 3, 3), [a, m] = d x'_a / d x_m in mm per mm, by central differences at points (N, 3), RAS mm."""
    steps = HALF_STEP_MM * np.concatenate([np.eye(3), -np.eye(3)])
    moved = map_points((points[None] + steps[:, None]).reshape(-1, 3))
    back = T_scene_ct.inverse().apply(moved).reshape(6, len(points), 3)
    return ((back[:3] - back[3:]) / (2 * HALF_STEP_MM)).transpose(1, 2, 0)
