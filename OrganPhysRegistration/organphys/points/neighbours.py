"""Nearest neighbours on several threads, safe against Ctrl-C."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array

MOST_THREADS = 8
FEW = 2000  # points: threads are not worth their start for fewer


def nearest_neighbours(tree: cKDTree, points: Array, **options: Any) -> tuple[Array, NDArray[np.int64]]:
    """Distances and indices as of ``tree.query(points, **options)``, points (N, 3).

    With cKDTree's own ``workers`` an exception from a signal leaves threads behind that write into freed memory.
    These threads own what they write, and the block waits for them.
    """
    threads = min(os.cpu_count() or 1, MOST_THREADS)
    if len(points) < FEW or threads == 1:
        distance, index = tree.query(points, **options)
        return distance, index
    with ThreadPoolExecutor(threads) as pool:
        parts = list(pool.map(lambda part: tree.query(part, **options), np.array_split(points, threads)))
    return np.concatenate([distance for distance, _ in parts]), np.concatenate([index for _, index in parts])
