"""Fine quadrature inside some of a body's cells, for local functions that the coarse points cannot integrate.

The fine points of a cell are those of one fixed grid that lie in it. A cell is refined once and always alone, so that
what comes out does not depend on what else was asked for, and moving the local functions costs the new cells only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array
from .quadrature import Quadrature
from .rest_shape import RestShape
from .simulation_basis import SimulationBasis


class FinePoints(NamedTuple):
    """Points (k, 3) m and volumes (k,) m^3 that stand for cells, with the basis there: phi (k, n), slopes (3, k, n)."""

    points: Array
    weights: Array
    phi: Array
    slopes: Array

    @classmethod
    def joined(cls, parts: list[FinePoints]) -> FinePoints:
        """Those of several cells in a row."""
        points, weights, phi = (np.concatenate([part[k] for part in parts]) for k in range(3))
        return cls(points, weights, phi, np.concatenate([part.slopes for part in parts], axis=1))


class RefinedCells:
    """Cells of a shape with their fine points ``spacing`` m apart and a basis evaluated at them."""

    def __init__(self, shape: RestShape, basis: SimulationBasis, spacing: float) -> None:
        self._shape, self._basis, self._spacing = shape, basis, spacing
        self._tree = cKDTree(shape.points)
        self._known: dict[int, FinePoints] = {}
        shape.surface.signed(shape.points[:1])  # makes what the surface keeps for its queries

    def of(self, cells: NDArray[np.int64]) -> FinePoints:
        """Fine points of the cells (k,), which keep their volume."""
        new = [cell for cell in cells.tolist() if cell not in self._known]
        for cell, fine in zip(new, fine_quadratures(self._shape, self._tree, new, self._spacing), strict=True):
            self._known[cell] = FinePoints(*fine, *self._basis.phi_and_gradient(fine.points))
        return FinePoints.joined([self._known[cell] for cell in cells.tolist()])


def fine_quadratures(shape: RestShape, tree: cKDTree, cells: list[int], spacing: float) -> list[Quadrature]:
    """Grid points ``spacing`` m apart in each cell, with its volume shared out evenly; its own point if it has none.

    A grid point lies in a cell if it is inside the body and the nearest of the shape's points (``tree``) is the
    cell's.
    """
    grids = [_grid_in_cell(shape, tree, cell, spacing) for cell in cells]
    ends = np.cumsum([len(grid) for grid in grids])
    inside = np.split(shape.surface.signed(np.concatenate(grids)) < 0, ends[:-1]) if grids else []
    out = []
    for cell, grid, kept in zip(cells, grids, inside, strict=True):
        points, volume = grid[kept], shape.cells.quadrature.weights[cell]
        if not len(points):
            points = shape.cells.quadrature.points[[cell]]
        out.append(Quadrature(points, np.full(len(points), volume / len(points))))
    return out


def _grid_in_cell(shape: RestShape, tree: cKDTree, cell: int, spacing: float) -> Array:
    own = shape.points[shape.cells.owner == cell]
    low, high = (np.round(edge / spacing).astype(np.int64) for edge in (own.min(0) - spacing, own.max(0) + spacing))
    axes = [spacing * np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[shape.cells.owner[tree.query(grid)[1]] == cell]


def lattice_near(centre: Array, radius: float, spacing: float) -> Array:
    """Points (k, 3) of the cubic lattice through the origin within ``radius`` of ``centre`` (3,), all in m."""
    low, high = (np.round((centre + side * radius) / spacing).astype(np.int64) for side in (-1, 1))
    axes = [spacing * np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return lattice[within(lattice, centre, radius)]


def within(points: Array, centre: Array, radius: float) -> NDArray[np.bool_]:
    """(N,) bool: which points (N, 3) lie within ``radius`` of ``centre`` (3,)."""
    near: NDArray[np.bool_] = ((points - centre) ** 2).sum(1) <= radius**2
    return near
