"""The inverse of a displacement on a grid: e with x = q + e(q) and x + d(x) = q."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from ..asset.deformation import Deformation
from ..asset.inverse_map import invert
from ..ground.checks import Array
from .grid_axes import GridAxes, doubled

STEPS = 12
TOLERANCE_MM = 2e-3


def inverse_displacement(deformation: Deformation, axes: GridAxes, forward: Array) -> Array:
    """e (nx, ny, nz, 3) in mm at the nodes from d = ``forward`` (nx, ny, nz, 3).

    Solved at every second node by Newton steps on the cubic spline through d there, with the slope of the nearest
    node; nodes that this leaves go to the exact inverse. The rest is filled in by cubic interpolation.
    """
    half = axes.every_second
    d = np.ascontiguousarray(forward[::2, ::2, ::2])
    active = ndimage.binary_dilation((d != 0).any(-1), np.ones((3, 3, 3)))
    targets = half.nodes(active)
    e, residual = _newton(d, half, targets)
    left = np.flatnonzero(residual > TOLERANCE_MM)
    if len(left):
        exact = invert(deformation, targets[left])
        e[left[exact.converged]] = exact.points[exact.converged] - targets[left[exact.converged]]
    inverse = np.zeros_like(d)
    inverse[active] = e
    return doubled(inverse)


def _newton(d: Array, axes: GridAxes, targets: Array) -> tuple[Array, Array]:
    """e (N, 3) for targets q (N, 3), and what is left of x + d(x) - q (N,), mm."""
    spline = [ndimage.spline_filter(d[..., a], order=3) for a in range(3)]
    slope = np.stack(np.gradient(d, axes.spacing, axis=(0, 1, 2)), axis=-1)  # (..., a, m) = d d_a / d x_m
    inverse_slope = np.linalg.inv(slope + np.eye(3))
    last = np.array(axes.counts) - 1

    def displacement(points: Array) -> Array:
        index = ((points - axes.origin) / axes.spacing).T
        return np.stack([ndimage.map_coordinates(c, index, order=3, prefilter=False) for c in spline], axis=1)

    e, residual = np.zeros_like(targets), np.full(len(targets), np.inf)
    rows = np.arange(len(targets))
    for _ in range(STEPS):
        x = targets[rows] + e[rows]
        error = e[rows] + displacement(x)
        residual[rows] = np.linalg.norm(error, axis=1)
        rows_left = residual[rows] > TOLERANCE_MM / 4
        rows, error, x = rows[rows_left], error[rows_left], x[rows_left]
        if not len(rows):
            break
        node = np.clip(np.rint((x - axes.origin) / axes.spacing).astype(np.int64), 0, last)
        e[rows] -= np.einsum("nij,nj->ni", inverse_slope[tuple(node.T)], error)
    return e, residual
