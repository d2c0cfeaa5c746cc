"""Quadrature with fine points in a ball and the coarse cells elsewhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError
from .quadrature import Quadrature, centroids
from .rest_shape import RestShape


class RefinedCells(NamedTuple):
    """Indices of the coarse cells that stay as they are, and the points that stand for the others."""

    kept: NDArray[np.int64]
    new: Quadrature


def refined_cells(shape: RestShape, centre: Array, reach: float, spacing: float) -> RefinedCells:
    """Fine points ``spacing`` m apart within ``reach`` m of ``centre`` (3,); the volume stays what it was.

    Coarse cells that the ball cuts are left with what lies outside. InputError if no tissue is in the ball.
    """
    inner, (cells, owner) = within(shape.points, centre, reach), shape.cells
    fine = inside_grid(shape, centre, reach, spacing)
    volume = float(shape.volumes[inner].sum())
    if not len(fine) or not volume > 0:
        raise InputError(f"local detail: no tissue within {1000 * reach:.1f} mm of {np.round(centre, 4).tolist()} m")
    cut = np.zeros(len(cells.points), dtype=bool)
    cut[owner[inner]] = True
    rim = cut[owner] & ~inner
    left = (
        centroids(shape.points[rim], shape.volumes[rim], owner[rim]) if rim.any() else Quadrature(fine[:0], fine[:0, 0])
    )
    even = np.full(len(fine), volume / len(fine))
    new = Quadrature(np.concatenate([fine, left.points]), np.concatenate([even, left.weights]))
    return RefinedCells(np.flatnonzero(~cut), new)


def inside_grid(shape: RestShape, centre: Array, radius: float, spacing: float) -> Array:
    """Grid points (k, 3) inside the body within ``radius`` of ``centre``, ``spacing`` m apart."""
    axis = spacing * np.arange(-int(radius / spacing), int(radius / spacing) + 1)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    grid = centre + grid[within(grid, np.zeros(3), radius)]
    return grid[shape.surface.signed(grid) < 0]


def within(points: Array, centre: Array, radius: float) -> NDArray[np.bool_]:
    """(N,) bool: which points (N, 3) lie within ``radius`` of ``centre`` (3,)."""
    near: NDArray[np.bool_] = ((points - centre) ** 2).sum(1) <= radius**2
    return near
