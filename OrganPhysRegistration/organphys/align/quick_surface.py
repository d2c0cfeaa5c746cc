"""The surface of one splat among many, in half of the time: for following an organ from frame to frame.

Stray points are told by how many others lie in the cells around them, and every point takes the normal of the smooth
patch nearest to its cell instead of a plane through its own neighbours.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..points.cells import Cells
from ..points.sampling import random_subset
from ..points.target_selection import mean_distance
from .splat_surface import SplatSurface, SplatSurfaceOptions, enough, rms_radius, towards_camera
from .surface_patches import on_patches

QUICK = SplatSurfaceOptions(centres=40_000, samples=1800)
MEASURED = 1000  # points by which the spacing is measured


def quick_surface(centres: Array, *, options: SplatSurfaceOptions = QUICK, seed: int = 0) -> SplatSurface:
    """As ``splat_surface``, of opaque Gaussian centres (N, 3), camera frame; ``samples``: well filled cells."""
    points = enough(centres[random_subset(len(centres), options.centres, seed)].astype(np.float64), options)
    cells = Cells.of(points, min(options.samples, len(points) // 3))
    cleaning = options.cleaning
    kept = cells.surface(sparse=cleaning.spread**-2, smallest=cleaning.smallest)
    means, stays = cells.mean(points), kept[cells.of_point]
    points = enough(points[stays], options)
    filled = means[kept & (cells.number >= cells.least)]
    samples, normals = on_patches(points, filled, -filled, neighbours=options.in_patch(len(points)))
    normals = towards_camera(samples, normals)
    nearest = cKDTree(samples).query(means)[1][cells.of_point[stays]]
    return SplatSurface(
        points, normals[nearest], samples, normals, _spacing(points, cleaning.neighbours, seed), rms_radius(points)
    )


def _spacing(points: Array, neighbours: int, seed: int) -> float:
    """Median neighbour distance, from some of the points: on a surface it falls with the root of their number."""
    some = random_subset(len(points), MEASURED, seed)
    return float(np.median(mean_distance(points[some], neighbours)) * np.sqrt(len(some) / len(points)))
