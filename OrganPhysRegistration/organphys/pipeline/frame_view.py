"""The splat of one time step made into a target quickly: cleaned by a subset of its Gaussians, with all of its rim."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..align.quick_surface import quick_surface
from ..align.splat_view import SplatView, splat_view
from ..ground.checks import Array, InputError
from ..ground.progress import no_progress
from ..points.neighbours import nearest_neighbours
from ..points.point_sets import Box, Camera, GaussianCloud
from .registration import RegisterOptions
from .scene import select_scene

REACH = 0.35  # of the organ's rms radius: how far from where it was the organ is looked for in a cluttered scene
THINNED = 3  # every third surface sample tells of tissue that is held away


@dataclass(frozen=True)
class Near:
    """Where the organ was: surface points (S, 3) and its rms radius, scene units."""

    points: Array
    radius: float


def frame_view(
    splat: GaussianCloud, camera: Camera, box: Box | None, options: RegisterOptions, near: Near | None = None
) -> SplatView:
    """View of one frame's splat; InputError where nothing can be seen in it. ``near``: only what lies there counts as
    the organ, the rest may hide it."""
    scene = select_scene(splat, box, options, no_progress)
    centres, others = scene.centres, scene.others
    if near is not None:
        reached = nearest_neighbours(cKDTree(near.points), centres, distance_upper_bound=REACH * near.radius)[0]
        inside = np.isfinite(reached)
        if not inside.any():
            raise InputError("splat: nothing is left where the organ was")
        centres, others = centres[inside], np.concatenate([others, centres[~inside]])
    return splat_view(centres, others, camera, surface_of=quick_surface, thinned=THINNED, seed=options.seed)
