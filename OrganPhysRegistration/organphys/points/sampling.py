"""Subsampling of point sets: seeded, vectorised."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array

_AXIS = (1 << 21) - 1  # the most cells along an axis that a key can hold


def random_subset(count: int, size: int, seed: int | np.random.Generator) -> NDArray[np.int64]:
    """Sorted indices (min(count, size),) of a uniform subset of range(count)."""
    if count <= size:
        return np.arange(count)
    return np.sort(np.random.default_rng(seed).choice(count, size, replace=False))


def farthest_points(points: Array, size: int) -> NDArray[np.int64]:
    """Indices (min(N, size),) by farthest-point sampling, starting at the point farthest from the centroid.

    O(N size); subsample first when N is large. Deterministic.
    """
    columns = np.ascontiguousarray(points.T, dtype=np.float32)  # (3, N): one pass per axis is cache friendly
    size = min(size, columns.shape[1])
    chosen = np.empty(size, dtype=np.int64)
    distance = ((columns - columns.mean(1, keepdims=True)) ** 2).sum(0)
    chosen[0] = int(distance.argmax())
    distance = ((columns - columns[:, chosen[:1]]) ** 2).sum(0)
    for k in range(1, size):
        chosen[k] = int(distance.argmax())
        np.minimum(distance, ((columns - columns[:, chosen[k : k + 1]]) ** 2).sum(0), out=distance)
    return chosen


def cell_keys(points: Array, cell: float) -> NDArray[np.int64]:
    """One integer (N,) per point that names its cubic cell of edge ``cell``; equal keys share a cell.

    Cells are counted from the points' own corner and packed into 21 bits an axis, so distinct cells never collide.
    """
    keys = np.zeros(len(points), dtype=np.int64)
    for column in points.T if len(points) else ():  # one pass per axis is cache friendly
        index = ((column - column.min()) / cell).astype(np.int64)
        if index.max() > _AXIS:
            raise ValueError(f"cell: {cell} is too small for an extent of {np.ptp(points, axis=0).max()}")
        keys = (keys << 21) | index
    return keys


def cells_of_keys(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Cells (N, 3), counted along the axes, that ``cell_keys`` packed into ``keys`` (N,)."""
    return np.stack([keys >> 42, (keys >> 21) & _AXIS, keys & _AXIS], axis=1)


def one_per_cell(points: Array, cell: float) -> NDArray[np.int64]:
    """Sorted indices of the first point in every occupied cubic cell of edge ``cell``."""
    return np.sort(np.unique(cell_keys(points, cell), return_index=True)[1])
