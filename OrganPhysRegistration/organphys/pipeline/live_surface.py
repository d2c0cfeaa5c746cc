"""The organ's surface while the elastic stage runs, for display: carried along by the solver's surface samples.

The vertices' own basis functions cost as much as a third of the solve; the deformation is smooth, so the similarity
that fits the samples best, plus what is left at the four nearest of them, is right to a fraction of a millimetre.
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..ground.frames import fit_similarity
from ..points.neighbours import nearest_neighbours

EVERY_S = 0.2
NEIGHBOURS = 4


class LiveSurface:
    """Callable with the samples at rest (S, 3; CT mm) and now (S, 3; scene); passes the vertices (Nv, 3; scene units)
    on to ``show``, at most five times a second."""

    def __init__(self, vertices_ct: Array, show: Callable[[Array], None]) -> None:
        self.vertices_ct, self.show = vertices_ct, show
        self._shown = -np.inf
        self._nearest: NDArray[np.int64] = np.zeros((0, NEIGHBOURS), dtype=np.int64)
        self._weights: Array = np.zeros((0, NEIGHBOURS))

    def __call__(self, rest_ct: Array, now_scene: Array) -> None:
        if perf_counter() - self._shown < EVERY_S:
            return
        self._shown = perf_counter()
        self.show(self.vertices(rest_ct, now_scene))

    def vertices(self, rest_ct: Array, now_scene: Array) -> Array:
        """Vertices (Nv, 3) in scene units; the samples at rest must be the same ones in every call."""
        if not len(self._nearest):
            distance, self._nearest = nearest_neighbours(cKDTree(rest_ct), self.vertices_ct, k=NEIGHBOURS)
            weights = 1 / (distance**2 + 1e-6 * distance.max() ** 2 + 1e-12)
            self._weights = weights / weights.sum(1, keepdims=True)
        T_scene_ct = fit_similarity(rest_ct, now_scene)
        left = now_scene - T_scene_ct.apply(rest_ct)
        return T_scene_ct.apply(self.vertices_ct) + np.einsum("nk,nkd->nd", self._weights, left[self._nearest])
