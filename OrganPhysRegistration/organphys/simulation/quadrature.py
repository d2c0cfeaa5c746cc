"""Quadrature of a volume known by many weighted points: one point and one weight per cell of nearby points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..points.sampling import random_subset

ROUNDS = 3


class Quadrature(NamedTuple):
    """Points (Q, 3) in m and their volumes (Q,) in m^3."""

    points: Array
    weights: Array


class Cells(NamedTuple):
    """Quadrature whose point k stands for the finer points (N,) with ``owner`` k, as their centroid."""

    quadrature: Quadrature
    owner: NDArray[np.int64]


def cell_quadrature(points: Array, volumes: Array, count: int, seed: int) -> Cells:
    """At most ``count`` points: centroids of the cells of a centroidal Voronoi partition (Lloyd) of points (N, 3).

    Any function that is linear inside the cells is integrated as the N points with their volumes (N,) would do it.
    """
    centres = points[random_subset(len(points), count, seed)]
    for _ in range(ROUNDS):
        owner = np.unique(cKDTree(centres).query(points)[1], return_inverse=True)[1]
        cells = centroids(points, volumes, owner)
        centres = cells.points
    return Cells(cells, owner)


def centroids(points: Array, volumes: Array, owner: NDArray[np.int64]) -> Quadrature:
    """One point per owner 0, 1, ... that has any of the points (N, 3) with volumes (N,), in the order of the owners."""
    weights = np.bincount(owner, volumes).astype(np.float64)
    moments = np.stack([np.bincount(owner, volumes * points[:, k]) for k in range(3)], axis=1)
    some = weights > 0
    return Quadrature(moments[some] / weights[some, None], weights[some])
