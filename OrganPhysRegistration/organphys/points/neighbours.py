"""Nearest neighbours on several threads, safe against Ctrl-C."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array

MOST_THREADS = 8
FEW = 2000  # points with one neighbour each: threads are not worth their start for fewer
MORE = 0.1  # what every further neighbour takes, beside the first
CELLS = 32  # along the longest side, by which scattered points are put in order
SCATTERED = 0.05  # of the longest side: median way from one point to the next, above which they are


def nearest_neighbours(tree: cKDTree, points: Array, **options: Any) -> tuple[Array, NDArray[np.int64]]:
    """Distances and indices as of ``tree.query(points, **options)``, points (N, 3).

    With cKDTree's own ``workers`` an exception from a signal leaves threads behind that write into freed memory.
    These threads own what they write, and the block waits for them.
    """
    if len(points) * (1 + MORE * _furthest(options.get("k", 1))) < FEW:
        distance, index = tree.query(points, **options)
        return distance, index
    order = _order(points)
    if order is None:
        return _in_threads(tree, points, options)
    sorted_distance, sorted_index = _in_threads(tree, points[order], options)
    distance, index = np.empty_like(sorted_distance), np.empty_like(sorted_index)
    distance[order], index[order] = sorted_distance, sorted_index
    return distance, index


def _furthest(k: int | Sequence[int]) -> int:
    return k if isinstance(k, int) else max(k)


def _in_threads(tree: cKDTree, points: Array, options: dict[str, Any]) -> tuple[Array, NDArray[np.int64]]:
    threads = min(os.cpu_count() or 1, MOST_THREADS)
    if threads == 1:
        distance, index = tree.query(points, **options)
        return distance, index
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(lambda part: tree.query(part, **options), np.array_split(points, threads)))
    return np.concatenate([distance for distance, _ in parts]), np.concatenate([index for _, index in parts])


def _order(points: Array) -> NDArray[np.int64] | None:
    """Order (N,) cell by cell, in which the search finds the tree's nodes in the cache; None where it is of no use."""
    low = points.min(0)
    side = float((points.max(0) - low).max())
    some = np.arange(0, len(points) - 1, max(1, len(points) // 500))
    steps = np.abs(points[some + 1] - points[some]).max(1)
    if not np.isfinite(side) or not np.median(steps) > SCATTERED * side:
        return None
    key = np.zeros(len(points), dtype=np.int32)
    for column, least in zip(points.T, low, strict=True):
        key = CELLS * key + ((column - least) * ((CELLS - 1e-3) / side)).astype(np.int32)
    return np.argsort(key, kind="stable")
