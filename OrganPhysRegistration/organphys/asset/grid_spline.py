"""A uniform cubic B-spline over a regular grid: twice continuously differentiable, with its exact gradient."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.sparse import csr_array

from ..ground.checks import Array


@dataclass(frozen=True)
class GridSpline:
    """f(x) = sum of coefficients (nx, ny, nz, C) times the cubic B-splines of the nodes origin + spacing * index.

    The coefficients are not pre-filtered: node values smooth a little and never overshoot. Points beyond the
    outermost cells take the value of the border.
    """

    origin: Array
    spacing: float
    coefficients: Array

    def values(self, points: Array) -> Array:
        """Values (N, C) at the points (N, 3)."""
        patch, (wx, wy, wz), _ = self._patches(points)
        return np.einsum("nk,nkc->nc", wz, self._over_yx(patch, wx, wy))

    def values_and_gradients(self, points: Array) -> tuple[Array, Array]:
        """Values (N, C) and gradients (N, C, 3) per unit of length of the points (N, 3)."""
        patch, (wx, wy, wz), (dx, dy, dz) = self._patches(points)
        row = self._over_yx(patch, wx, wy)
        gradients = (
            np.einsum("nk,nkc->nc", wz, self._over_yx(patch, dx, wy)),
            np.einsum("nk,nkc->nc", wz, self._over_yx(patch, wx, dy)),
            np.einsum("nk,nkc->nc", dz, row),
        )
        return np.einsum("nk,nkc->nc", wz, row), np.stack(gradients, axis=-1) / self.spacing

    def on_axes(self, x: Array, y: Array, z: Array) -> Array:
        """Values (len(x), len(y), len(z), C) on a grid of points; axis by axis, so a hundred times faster."""
        grid = self.coefficients
        for k, places in enumerate((x, y, z)):  # after each step the axis dealt with is the last but one
            shape = grid.shape
            flat = np.ascontiguousarray(grid).reshape(shape[0], -1)
            done = (self._axis_matrix(k, places) @ flat).reshape(len(places), *shape[1:])
            grid = np.moveaxis(done, 0, 2)
        return np.ascontiguousarray(grid)

    def _axis_matrix(self, k: int, places: Array) -> csr_array:
        """Matrix (len(places), n_k) of the spline weights along axis k."""
        count = self.coefficients.shape[k]
        position = np.clip((places - self.origin[k]) / self.spacing, 1.0, count - 2 - 1e-9)
        base = position.astype(np.int64)
        columns = base[:, None] + np.arange(-1, 3)
        rows = np.repeat(np.arange(len(places)), 4)
        weights = _weights(position - base).ravel()
        return csr_array((weights, (rows, columns.ravel())), shape=(len(places), count))

    def _patches(self, points: Array) -> tuple[Array, list[Array], list[Array]]:
        """Coefficients (N, 4, 4, 4 * C) round every point, and value and derivative weights, three of (N, 4) each."""
        shape = np.array(self.coefficients.shape[:3])
        position = np.clip((points - self.origin) / self.spacing, 1.0, shape - 2 - 1e-9)
        base = position.astype(np.int64)
        t = position - base
        channels = self.coefficients.shape[3]
        rows = self.coefficients.reshape(*shape[:2], -1)
        windows = sliding_window_view(rows, 4 * channels, axis=2)[:, :, ::channels]
        steps = np.arange(-1, 3)
        patch = windows[
            base[:, 0, None, None] + steps[:, None], base[:, 1, None, None] + steps, base[:, 2, None, None] - 1
        ]
        return patch, [_weights(t[:, k]) for k in range(3)], [_derivatives(t[:, k]) for k in range(3)]

    def _over_yx(self, patch: Array, along_x: Array, along_y: Array) -> Array:
        """Patch contracted over x and y: (N, 4, C)."""
        count, channels = len(patch), self.coefficients.shape[3]  # no -1 in the shapes: there may be no point
        over_x = np.matmul(along_x[:, None, :], patch.reshape(count, 4, 16 * channels)).reshape(count, 4, 4 * channels)
        return np.matmul(along_y[:, None, :], over_x).reshape(count, 4, channels)


def _weights(t: Array) -> Array:
    """Cubic B-spline weights (N, 4) of the four nodes round fraction t in 0..1."""
    s = 1 - t
    return np.stack([s**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * s**2 + 3 * s**3, t**3], axis=1) / 6


def _derivatives(t: Array) -> Array:
    """Derivatives (N, 4) of the weights by t."""
    s = 1 - t
    return np.stack([-(s**2), 3 * t**2 - 4 * t, 4 * s - 3 * s**2, t**2], axis=1) / 2
