"""Signed distance to the organ surface at the nodes of a grid: exact beside the surface, carried on from there."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from ..ground.checks import Array
from .surface_distance import SurfaceDistance

NEAR_CELLS = 2
SWEEPS = 2


def grid_distance(nodes: Array, surface: SurfaceDistance, spacing: float) -> Array:
    """Signed distance (nx, ny, nz) at nodes (nx, ny, nz, 3) with ``spacing`` between them, in the surface's unit.

    Exact up to about two cells from the surface. A node beyond takes the distance to the surface point closest to its
    nearest exact node, or to the point of a neighbour where that is nearer: up to a fifth of the spacing too long.
    """
    cells = np.rint((surface.samples(spacing) - nodes[0, 0, 0]) / spacing).astype(np.int64)
    near = np.zeros(nodes.shape[:3], dtype=bool)
    near[tuple(cells.T)] = True
    near = ndimage.binary_dilation(near, np.ones((3, 3, 3)), iterations=NEAR_CELLS)
    source = ndimage.distance_transform_edt(~near, return_distances=False, return_indices=True)
    row = np.full(near.shape, -1)
    row[near] = np.arange(near.sum())
    exact, feet = surface.signed_with_foot(nodes[near])
    nearest = row[tuple(source)]
    distance = np.sign(exact[nearest]) * _carried_on(nodes, feet[nearest])
    distance[near] = exact
    return distance


def _carried_on(nodes: Array, feet: Array) -> Array:
    """Distance (nx, ny, nz) of the nodes to their own or a neighbour's surface point; ``feet`` is changed."""
    squared = ((nodes - feet) ** 2).sum(-1)
    ahead, behind = slice(1, None), slice(None, -1)
    for _ in range(SWEEPS):
        for axis in range(3):
            for to, source in ((ahead, behind), (behind, ahead)):
                here = tuple(to if k == axis else slice(None) for k in range(3))
                there = tuple(source if k == axis else slice(None) for k in range(3))
                trial = ((nodes[here] - feet[there]) ** 2).sum(-1)
                closer = trial < squared[here]
                squared[here] = np.where(closer, trial, squared[here])
                feet[here] = np.where(closer[..., None], feet[there], feet[here])
    distance: Array = np.sqrt(squared)
    return distance
