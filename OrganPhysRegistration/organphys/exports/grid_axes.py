"""Regular grids with an odd number of nodes per axis, so that every second node is a grid too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array

# weights of the four nodes, one row each, as polynomials of the place in the cell (constant, t, t^2, t^3)
CATMULL_ROM = np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]]) / 2


@dataclass(frozen=True)
class GridAxes:
    """Nodes origin + spacing * index; counts (nx, ny, nz), all odd; origin (3,) and spacing in mm."""

    origin: Array
    spacing: float
    counts: tuple[int, int, int]

    @classmethod
    def round(cls, points: Array, margin: float, spacing: float, *, most: int) -> GridAxes:
        """Grid over points (N, 3) and ``margin`` round them; coarser where it would have over ``most`` nodes."""
        low, size = points.min(0) - margin, np.ptp(points, axis=0) + 2 * margin
        least = float((np.prod(size) / most) ** (1 / 3))
        spacing = max(spacing, float((np.prod(size + 4 * least) / most) ** (1 / 3)))
        nx, ny, nz = (int(n) for n in 2 * np.ceil(size / (2 * spacing)).astype(int) + 1)
        return cls(low, spacing, (nx, ny, nz))

    @property
    def all(self) -> tuple[Array, Array, Array]:
        """Coordinates along each axis."""
        x, y, z = (self.origin[k] + self.spacing * np.arange(self.counts[k]) for k in range(3))
        return x, y, z

    @property
    def every_second(self) -> GridAxes:
        nx, ny, nz = ((n + 1) // 2 for n in self.counts)
        return GridAxes(self.origin, 2 * self.spacing, (nx, ny, nz))

    def nodes(self, mask: NDArray[np.bool_]) -> Array:
        """Positions (N, 3) of the nodes set in a mask (nx, ny, nz)."""
        return self.origin + self.spacing * np.argwhere(mask)

    def is_full(self, most: int) -> bool:
        """Whether a finer grid would have over ``most`` nodes."""
        return bool(1.2 * np.prod(self.counts) > most)


def doubled(values: Array) -> Array:
    """Values (m0, m1, m2, C) at every second node filled in to (2 m0 - 1, ...) by cubic interpolation.

    Four-point Lagrange weights (-1, 9, 9, -1) / 16 between the nodes; at the ends the last node counts twice.
    """
    for axis in range(3):
        a = np.moveaxis(values, axis, 0)
        padded = np.concatenate([a[:1], a, a[-1:]])
        fine = np.empty((2 * len(a) - 1, *a.shape[1:]))
        fine[::2] = a
        fine[1::2] = (9 / 16) * (padded[1:-2] + padded[2:-1]) - (1 / 16) * (padded[:-3] + padded[3:])
        values = np.moveaxis(fine, 0, axis)
    return values


def trilinear(vectors: NDArray[np.floating], axes: GridAxes, points: Array) -> Array:
    """Vectors (nz, ny, nx, 3) of the nodes at points (N, 3) within the grid, as image programs interpolate: (N, 3)."""
    base, t = _cells(axes, points)
    return _weighted(vectors, base, np.stack([1 - t, t]))


def cubic(vectors: NDArray[np.floating], axes: GridAxes, points: Array) -> Array:
    """As ``trilinear``, with Catmull-Rom's four points per axis: what VTK's grid transform does, and so Slicer's.

    Points (N, 3) must lie one node or more within the border.
    """
    base, t = _cells(axes, points)
    weights = CATMULL_ROM @ np.stack([np.ones_like(t), t, t**2, t**3]).reshape(4, -1)
    return _weighted(vectors, base - 1, weights.reshape(4, *t.shape))


def _cells(axes: GridAxes, points: Array) -> tuple[NDArray[np.int64], Array]:
    """First node (N, 3) of the cell of each point, and the place (N, 3) in it, 0 to 1."""
    position = np.clip((points - axes.origin) / axes.spacing, 0, np.array(axes.counts) - 1.000001)
    base = position.astype(np.int64)
    return base, position - base


def _weighted(vectors: NDArray[np.floating], first: NDArray[np.int64], weights: Array) -> Array:
    """Sum (N, 3) over the nodes from ``first`` (N, 3) on; weights (nodes per axis, N, 3)."""
    result = np.zeros((len(first), 3))
    for corner in np.ndindex(*3 * (len(weights),)):
        i, j, k = (first + corner).T
        weight = weights[corner[0], :, 0] * weights[corner[1], :, 1] * weights[corner[2], :, 2]
        result += weight[:, None] * vectors[k, j, i]
    return result
