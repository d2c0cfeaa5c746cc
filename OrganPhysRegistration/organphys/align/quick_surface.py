"""The surface of one splat among many, in a third of the time: for following an organ from frame to frame.

Cleaning judges fewer points, and every point takes the normal of the smooth patch next to it instead of a plane through
its own neighbours.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..points.neighbours import nearest_neighbours
from ..points.sampling import random_subset
from ..points.target_selection import CleaningOptions, clean_points
from .splat_surface import SplatSurface, SplatSurfaceOptions, cell_averages, checked_count, towards_camera
from .surface_patches import on_patches

QUICK = SplatSurfaceOptions(cleaning=CleaningOptions(rounds=1, most=9000))


def quick_surface(centres: Array, *, options: SplatSurfaceOptions = QUICK, seed: int = 0) -> SplatSurface:
    """As ``splat_surface``, of opaque Gaussian centres (N, 3), camera frame."""
    points = centres[random_subset(len(centres), options.centres, seed)].astype(np.float64)
    cleaning = clean_points(points, options=options.cleaning)
    points = points[cleaning.keep]
    checked_count(points, options)
    means, _ = cell_averages(points, -points, min(options.samples, len(points) // 3))
    neighbours = max(options.fewest_in_patch, round(options.patch * len(points)))
    samples, normals = on_patches(points, means, -means, neighbours=neighbours)
    normals = towards_camera(samples, normals)
    nearest = nearest_neighbours(cKDTree(samples), points)[1]
    radius = float(np.sqrt(((points - points.mean(0)) ** 2).sum(1).mean()))
    return SplatSurface(points, normals[nearest], samples, normals, cleaning.spacing, radius)
