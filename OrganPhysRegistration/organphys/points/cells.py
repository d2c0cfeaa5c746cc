"""Points sorted into cubic cells: means over each, and which cells hold a surface instead of stray points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..ground.checks import Array
from .sampling import cell_keys, cells_of_keys

BESIDE = 1.8  # cells: those that share a face, an edge or a corner lie nearer
FILLED = 0.25  # of the mean number of points, below which a cell counts for nothing: it is the noisiest

WIDER = 1.6  # most that the edge changes at once


@dataclass(frozen=True)
class Cells:
    """index (K, 3): occupied cells, counted along the axes; of_point (N,): the cell of every point; number (K,): how
    many points each holds; least: points that a well filled cell holds."""

    index: NDArray[np.int64]
    of_point: NDArray[np.int64]
    number: NDArray[np.int64]
    least: float

    @classmethod
    def of(cls, points: Array, count: int, *, rounds: int = 8) -> Cells:
        """Cells of points (N, 3), of a size at which about ``count`` are well filled, as far as a surface goes: their
        number falls with the square of the edge."""
        least = max(2.0, FILLED * len(points) / count)
        offset = np.abs(points - np.median(points, axis=0)).max(1)
        edge = max(float(np.median(offset)) / 15, 1e-6 * float(offset.max()), 1e-300)
        for _ in range(rounds):
            number = np.unique(cell_keys(points, edge), return_counts=True)[1]
            filled = number[number >= least]
            if 0.92 * count < len(filled) < 1.08 * count:
                break
            too_small = 2 * filled.sum() < len(points)  # most points lie in cells that are hardly filled
            edge *= WIDER if too_small else float(np.clip(np.sqrt(len(filled) / count), 1 / WIDER, WIDER))
        keys, of_point, number = np.unique(cell_keys(points, edge), return_inverse=True, return_counts=True)
        return cls(cells_of_keys(keys), of_point, number, least)

    @cached_property
    def _beside(self) -> NDArray[np.int64]:
        """Pairs (P, 2) of cells that touch."""
        return cKDTree(self.index).query_pairs(BESIDE, output_type="ndarray")

    @property
    def crowd(self) -> NDArray[np.int64]:
        """(K,) points in each cell and those that touch it."""
        one, other = self._beside.T
        crowd = self.number.copy()
        np.add.at(crowd, one, self.number[other])
        np.add.at(crowd, other, self.number[one])
        return crowd

    def surface(self, *, sparse: float, smallest: float) -> NDArray[np.bool_]:
        """(K,) bool: cells with a crowd of at least ``sparse`` times the usual point's, and of those the pieces that
        hold together ``smallest`` of all their points or more."""
        crowd = self.crowd
        kept: NDArray[np.bool_] = crowd >= sparse * np.median(crowd[self.of_point])
        one, other = self._beside[kept[self._beside].all(1)].T
        links = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(len(kept), len(kept)))
        piece = connected_components(links, directed=False)[1]
        held = np.bincount(piece, np.where(kept, self.number, 0))
        return kept & (held[piece] >= smallest * held.sum())

    def mean(self, points: Array) -> Array:
        """Mean (K, C) of the points' values (N, C)."""
        sums = [np.bincount(self.of_point, column, len(self.number)) for column in points.T]
        return np.stack(sums, axis=1) / self.number[:, None]
