"""Smooth extension of grid values from known nodes to all nodes: near nodes follow closely, far ones an average.

The pull-push scheme of Gortler et al., "The Lumigraph", SIGGRAPH 1996, in three dimensions: the width of the average
grows with the distance from the known nodes, so that the two sides of a cleft blend into each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array


def fill_outwards(values: Array, known: NDArray[np.bool_]) -> Array:
    """Values (nx, ny, nz, C) with the nodes outside ``known`` (nx, ny, nz) filled in; known nodes stay as they are."""
    if not known.any():
        raise ValueError("known: no node carries a value")
    weight = known.astype(values.dtype)[..., None]
    return _fill(np.where(known[..., None], values, 0.0), weight)


def _fill(sums: Array, weight: Array) -> Array:
    """Filled values from weighted sums (nx, ny, nz, C) and their weights (nx, ny, nz, 1) in 0..1."""
    own = sums / np.maximum(weight, 1e-12)
    if max(sums.shape[:3]) <= 2:
        total = weight.sum()
        return np.where(weight > 0, own, sums.sum((0, 1, 2)) / total)
    coarse = _fill(_halve(sums), _halve(weight))
    trust = 1 - (1 - np.minimum(weight, 1.0)) ** 4  # a cell that is a quarter full already speaks for itself
    return trust * own + (1 - trust) * _double(coarse, sums.shape)


def _halve(grid: Array) -> Array:
    """Every axis at half resolution with the kernel 1 3 3 1 (zeros outside the grid)."""
    for axis in range(3):
        count = grid.shape[axis]
        widths = [(1, 2 + count % 2) if k == axis else (0, 0) for k in range(grid.ndim)]
        padded = np.moveaxis(np.pad(grid, widths), axis, 0)
        pairs = (count + 1) // 2
        taps = [padded[k : k + 2 * pairs : 2][:pairs] for k in range(4)]
        grid = np.moveaxis((taps[0] + 3 * taps[1] + 3 * taps[2] + taps[3]) / 8, 0, axis)
    return grid


def _double(grid: Array, shape: tuple[int, ...]) -> Array:
    """Every axis at double resolution, linear between the coarse cells, cut to ``shape``."""
    for axis in range(3):
        a = np.moveaxis(grid, axis, 0)
        before, after = np.concatenate([a[:1], a[:-1]]), np.concatenate([a[1:], a[-1:]])
        fine = np.stack([(3 * a + before) / 4, (3 * a + after) / 4], axis=1).reshape(-1, *a.shape[1:])
        grid = np.moveaxis(fine[: shape[axis]], 0, axis)
    return grid
