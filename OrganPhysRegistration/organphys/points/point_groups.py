"""The points around each of many places, and means and medians over them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array

SHORT = 1 << 16  # numpy sorts whole numbers below it by radix, seven times faster than others


@dataclass(frozen=True)
class PointGroups:
    """Points around each of ``count`` places: ``place`` (P,), rising, and ``member`` (P,) of every pair."""

    count: int
    place: NDArray[np.int64]
    member: NDArray[np.int64]

    @classmethod
    def within(cls, tree: cKDTree, places: Array, radius: float) -> PointGroups:
        """The tree's points within ``radius`` of the places (K, D); many times faster than lists of them."""
        pairs = cKDTree(places).sparse_distance_matrix(tree, radius, output_type="ndarray")
        order = _in_order(pairs["i"], len(places))
        return cls(len(places), pairs["i"][order], pairs["j"][order])

    @property
    def sizes(self) -> NDArray[np.int64]:
        """(K,) points of each place."""
        return np.bincount(self.place, minlength=self.count)

    def where(self, kept: NDArray[np.bool_]) -> PointGroups:
        """The pairs (P,) marked."""
        return PointGroups(self.count, self.place[kept], self.member[kept])

    def mean(self, values: Array) -> Array:
        """Mean (K, C) of the points' ``values`` (N, C); 0 where there are no points."""
        sums = [np.bincount(self.place, column[self.member], self.count) for column in values.T]
        return np.stack(sums, axis=1) / np.maximum(self.sizes, 1)[:, None]

    def ranked(self, of_pairs: Array) -> tuple[Array, NDArray[np.int64]]:
        """Values (P,) of the pairs, rising within each place, and where each place's begin (K + 1,)."""
        rising = np.argsort(of_pairs)
        rising = rising[_in_order(self.place[rising], self.count)]
        return of_pairs[rising], np.concatenate([[0], np.cumsum(self.sizes)])

    def median(self, values: Array, *, fewest: int = 1) -> Array:
        """Median (K,) of the points' finite ``values`` (N,); nan where there are fewer than ``fewest``."""
        known = self.where(np.isfinite(values)[self.member])
        ranked, begin = known.ranked(values[known.member])
        size, out = known.sizes, np.full(self.count, np.nan)
        found = size >= fewest
        first, size = begin[:-1][found], size[found]
        out[found] = (ranked[first + (size - 1) // 2] + ranked[first + size // 2]) / 2
        return out

    def line_at_zero(self, along: Array, values: Array) -> Array:
        """Value (K,) at 0 of the line fitted to the points' ``values`` (N,) against ``along`` (P,) of the pairs; nan
        where fewer than three points, or none apart from the others, hold it."""
        value = values[self.member]
        count, first, second, height, product = (
            np.bincount(self.place, weight, self.count)
            for weight in (np.ones(len(along)), along, along**2, value, along * value)
        )
        spread = count * second - first**2
        held = (count >= 3) & (spread > 1e-6 * count * second)
        found = np.full(self.count, np.nan)
        found[held] = ((second * height - first * product)[held]) / spread[held]
        return found


def _in_order(places: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Order (P,) in which ``places`` (P,) below ``count`` rise, those of one place as they were."""
    return np.argsort(places.astype(np.uint16) if count <= SHORT else places, kind="stable")
