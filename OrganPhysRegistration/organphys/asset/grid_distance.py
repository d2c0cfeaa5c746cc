"""Signed distance to the organ surface at the nodes of a grid: exact beside the surface, carried on from there."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from ..ground.checks import Array
from .surface_distance import SurfaceDistance

NEAR_CELLS = 2


def grid_distance(nodes: Array, surface: SurfaceDistance, spacing: float) -> Array:
    """Signed distance (nx, ny, nz) at nodes (nx, ny, nz, 3) with ``spacing`` between them, in the surface's unit.

    Exact up to about two cells from the surface. A node beyond takes the distance to the surface vertex nearest to
    its nearest exact node: at most 0.1 spacing too long.
    """
    cells = np.rint((surface.vertices - nodes[0, 0, 0]) / spacing).astype(np.int64)
    near = np.zeros(nodes.shape[:3], dtype=bool)
    near[tuple(cells.T)] = True
    near = ndimage.binary_dilation(near, np.ones((3, 3, 3)), iterations=NEAR_CELLS)
    source = ndimage.distance_transform_edt(~near, return_distances=False, return_indices=True)
    row = np.full(near.shape, -1)
    row[near] = np.arange(near.sum())
    exact, vertex = surface.signed_with_vertex(nodes[near])
    nearest = row[tuple(source)]
    distance = np.sign(exact[nearest]) * np.linalg.norm(nodes - surface.vertices[vertex[nearest]], axis=-1)
    distance[near] = exact
    return distance
