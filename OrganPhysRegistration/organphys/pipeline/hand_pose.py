"""A pose set by hand for the default method: refined close by, never carried off into another basin."""

from __future__ import annotations

import numpy as np

from ..align.poses import Poses
from ..align.splat_view import SplatView
from ..align.two_way_fit import TwoWayFit
from ..ground.frames import Similarity
from ..points.surface_samples import SurfaceSamples

ROUNDS = ((150, 0.2, 0.02, 6), (600, 0.12, 0.003, 14), (1500, 0.1, 0.001, 4))
"""Points a side, robust width (rms radii), damping and Gauss-Newton steps: the last three rounds of the search."""
NEAR_DEG, NEAR_SHIFT, NEAR_SCALE = 30.0, 0.5, 1.3  # a refined pose within these of the user's is still the user's


def poses_near(
    start: Similarity, samples: SurfaceSamples, view: SplatView, *, scale: float | None = None, seed: int = 0
) -> Poses:
    """The pose ``start`` = T_camera_normalised refined, if that stayed near; and the pose as it is, last.

    ``scale``: scene units per normalised length where it is known; it then replaces that of the pose.
    """
    given = Poses.of([start if scale is None else Similarity(scale, start.rotation, start.translation)])
    poses = given
    for points, tau, damping, steps in ROUNDS:
        fit = TwoWayFit(samples, samples.grid, view, count=points, seed=seed)
        for _ in range(steps):
            poses = fit.step(poses, tau, damping=damping, free_scale=scale is None)
    return Poses.join([poses, given]) if _is_near(poses.at(0), given.at(0)) else given


def _is_near(pose: Similarity, given: Similarity) -> bool:
    cosine = (np.trace(pose.rotation.T @ given.rotation) - 1) / 2
    shift = np.linalg.norm(pose.translation - given.translation) / given.scale
    ratio = abs(np.log(pose.scale / given.scale))
    return bool(cosine > np.cos(np.radians(NEAR_DEG)) and shift < NEAR_SHIFT and ratio < np.log(NEAR_SCALE))
