"""The inverse of a displacement on a grid: e with x = q + e(q) and x + d(x) = q."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..asset.deformation import Deformation
from ..asset.inverse_map import invert
from ..ground.checks import Array
from .grid_axes import GridAxes, doubled

STEPS = 12
TOLERANCE_MM = 2e-3
LOOK_MM = 0.02  # nodes at which the filled-in inverse misses by more are solved for themselves


def inverse_displacement(
    deformation: Deformation, axes: GridAxes, forward: Array, *, progress: Callable[[float], None] = lambda part: None
) -> Array:
    """e (nx, ny, nz, 3) in mm at the nodes from d = ``forward`` (nx, ny, nz, 3).

    Newton steps on the cubic spline through d: first at every second node, between which a cubic is filled in, then at
    the nodes where that is not good enough. Nodes that do not converge so go to the exact inverse. ``progress``: told
    the part done (0..1) before each step; what it raises ends the work.
    """
    half = axes.every_second
    coarse = SplineField(np.ascontiguousarray(forward[::2, ::2, ::2]), half)
    e = doubled(_solved(deformation, coarse, np.zeros_like(coarse.d), coarse.active, lambda: progress(0.0)))
    fine = SplineField(forward, axes)
    misses = np.zeros(forward.shape[:3], dtype=bool)
    misses[fine.active] = np.linalg.norm(fine.residual(e, fine.active), axis=1) > LOOK_MM
    e[~fine.active] = 0.0
    return _solved(deformation, fine, e, misses, lambda: progress(0.5))


class SplineField:
    """d (nx, ny, nz, 3) in mm at the nodes of ``axes`` and the cubic spline through it."""

    def __init__(self, d: Array, axes: GridAxes) -> None:
        self.d, self.axes = d, axes
        self.spline = [ndimage.spline_filter(d[..., a], order=3) for a in range(3)]
        self.active: NDArray[np.bool_] = ndimage.binary_dilation((d != 0).any(-1), np.ones((3, 3, 3)))

    def at(self, points: Array) -> Array:
        """Displacement (N, 3) at points (N, 3)."""
        index = ((points - self.axes.origin) / self.axes.spacing).T
        return np.stack([ndimage.map_coordinates(c, index, order=3, prefilter=False) for c in self.spline], axis=1)

    def residual(self, e: Array, rows: NDArray[np.bool_]) -> Array:
        """x + d(x) - q (N, 3) at the nodes q set in ``rows``, x = q + e."""
        return e[rows] + self.at(self.axes.nodes(rows) + e[rows])

    def slopes(self, points: Array) -> Array:
        """Identity plus the slope of d (N, 3, 3) at the nodes nearest to points (N, 3)."""
        last = np.array(self.axes.counts) - 1
        node = np.clip(np.rint((points - self.axes.origin) / self.axes.spacing).astype(np.int64), 1, last - 1)
        columns = []
        for m in range(3):
            step = np.eye(3, dtype=np.int64)[m]
            ahead, behind = self.d[tuple((node + step).T)], self.d[tuple((node - step).T)]
            columns.append((ahead - behind) / (2 * self.axes.spacing))
        slopes: Array = np.stack(columns, axis=2) + np.eye(3)
        return slopes


def _solved(
    deformation: Deformation, field: SplineField, start: Array, rows: NDArray[np.bool_], before_step: Callable[[], None]
) -> Array:
    """``start`` (nx, ny, nz, 3) with the nodes set in ``rows`` solved."""
    targets, e = field.axes.nodes(rows), start[rows]
    left, size = np.arange(len(targets)), np.full(len(targets), np.inf)
    for _ in range(STEPS):
        before_step()
        x = targets[left] + e[left]
        error = e[left] + field.at(x)
        size[left] = np.linalg.norm(error, axis=1)
        more = size[left] > TOLERANCE_MM
        left, x, error = left[more], x[more], error[more]
        if not len(left):
            break
        e[left] -= np.linalg.solve(field.slopes(x), error[:, :, None])[:, :, 0]
    if len(left):
        exact = invert(deformation, targets[left])
        good = exact.converged
        e[left[good]] = exact.points[good] - targets[left[good]]
    result = start.copy()
    result[rows] = e
    return result
