"""Displacements of surface vertices carried inside, for methods that know the surface only."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import RBFInterpolator

from organphys.ground.checks import Array
from organphys.ground.frames import Similarity

EXTENSION = "biharmonic spline through the surface vertices' displacements"


def extended(vertices: Array, moved: Array, T_scene_ct: Similarity) -> Callable[[Array], Array]:
    """Map of CT points (N, 3) mm to the scene that sends ``vertices`` (Nv, 3) mm to ``moved`` (Nv, 3), scene units.

    The thin-plate spline of three dimensions, kernel r with affine part (Bookstein, "Principal Warps", PAMI 1989, has
    the plane's); what is interpolated is the displacement beyond ``T_scene_ct``.
    """
    centre, radius = vertices.mean(0), float(np.abs(vertices - vertices.mean(0)).max())
    displacement = moved - T_scene_ct.apply(vertices)
    spline = RBFInterpolator((vertices - centre) / radius, displacement, kernel="linear", degree=1)

    def map_points(points_ct: Array) -> Array:
        return T_scene_ct.apply(points_ct) + spline((points_ct - centre) / radius)

    return map_points
