"""Quadrature of a volume known by many weighted points: one point and one weight per cell of nearby points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..points.sampling import random_subset

ROUNDS = 3


class Quadrature(NamedTuple):
    """Points (Q, 3) in m and their volumes (Q,) in m^3."""

    points: Array
    weights: Array


def cell_quadrature(points: Array, volumes: Array, count: int, seed: int) -> Quadrature:
    """At most ``count`` points: centroids of the cells of a centroidal Voronoi partition (Lloyd) of points (N, 3).

    Any function that is linear inside the cells is integrated as the N points with their volumes (N,) would do it.
    """
    centres = points[random_subset(len(points), count, seed)]
    for _ in range(ROUNDS):
        cell = cKDTree(centres).query(points)[1]
        weights = np.bincount(cell, volumes, len(centres)).astype(np.float64)
        moments = np.stack([np.bincount(cell, volumes * points[:, k], len(centres)) for k in range(3)], axis=1)
        filled = weights > 0
        centres, weights = moments[filled] / weights[filled, None], weights[filled]
    return Quadrature(centres, weights)
