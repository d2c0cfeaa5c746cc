"""First-order reproducing kernel particle (RKPM) shape functions with Gaussian kernels.

Liu, Jun, Zhang, "Reproducing kernel particle methods", Int. J. Numer. Methods Fluids 1995:
phi_I(x) = p(x)^T M(x)^-1 p(x_I) f_I(x), M = sum_I f_I p_I p_I^T, p = (1, x): sums to 1 and reproduces x.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array

# A Gaussian kernel alone leaves M singular far from all nodes. The kernels therefore widen there by a smooth factor
# of the soft minimum of their exponents: exactly 1 up to WIDEN_FROM (beyond any point of the organ).
WIDEN_FROM, WIDEN_OVER = 2.0, 4.0


@dataclass(frozen=True)
class ReproducingKernel:
    """Nodes (n, 3) and their kernel radii (n,), in the same unit as the points they are evaluated at."""

    nodes: Array
    radii: Array

    def shapes_with_gradient(self, points: Array) -> tuple[Array, Array]:
        """All shape functions phi_I (N, n) and derivatives (3, N, n) at points (N, 3): dense, for assembly."""
        kernel, widening, slope = self._kernel(points)
        p = _affine(self.nodes)
        outer = _outer(p)
        matrix = (kernel @ outer).reshape(-1, 4, 4)
        solved = np.linalg.solve(matrix, _affine(points)[:, :, None])
        correction = solved[:, :, 0] @ p.T
        gradients = np.empty((3, len(points), len(p)))
        for m, d_kernel in enumerate(self._kernel_derivatives(points, kernel, widening, slope)):
            right = -((d_kernel @ outer).reshape(-1, 4, 4) @ solved)
            right[:, m + 1, 0] += 1.0
            np.multiply(np.linalg.solve(matrix, right)[:, :, 0] @ p.T, kernel, out=gradients[m])
            d_kernel *= correction
            gradients[m] += d_kernel
        correction *= kernel
        return correction, gradients

    def combined(self, coefficients: Array, points: Array) -> Array:
        """sum_I phi_I(x) c_I at points (N, 3) for node coefficients (n, k): (N, k)."""
        kernel, p = self._kernel(points)[0], _affine(self.nodes)
        matrix = (kernel @ _outer(p)).reshape(-1, 4, 4)
        row = np.linalg.solve(matrix, _affine(points)[:, :, None])[:, :, 0]
        kernel *= row @ p.T
        return kernel @ coefficients

    def combined_with_gradient(self, coefficients: Array, points: Array) -> tuple[Array, Array]:
        """The same and its derivative: (N, k), (N, k, 3).

        With b = M^-1 p(x): phi_I = (b . p_I) f_I, and d b / d x_m = M^-1 (e_m - sum_I phi_I (d log f_I / d x_m) p_I).
        """
        kernel, widening, slope = self._kernel(points)
        k, p = coefficients.shape[1], _affine(self.nodes)
        matrix, load = _split(kernel @ self._moment_columns(coefficients), k)
        inverse = np.linalg.inv(matrix)
        row = (inverse @ _affine(points)[:, :, None])[:, :, 0]
        shapes = np.multiply(kernel, row @ p.T, out=kernel)
        sums = self._slope_sums(shapes, points, widening, slope, np.concatenate([coefficients, p], axis=1))
        d_row = -sums[:, :, k:]
        d_row[:, [0, 1, 2], [1, 2, 3]] += 1.0
        gradients = d_row @ inverse @ load  # M is symmetric
        gradients += sums[:, :, :k]
        return (row[:, None, :] @ load)[:, 0], gradients.transpose(0, 2, 1)

    def _exponents(self, points: Array) -> Array:
        """|x - x_I|^2 / r_I^2, (N, n)."""
        squared = points @ (-2.0 * self.nodes.T)
        squared += (self.nodes**2).sum(1)
        squared += (points**2).sum(1)[:, None]
        squared *= 1.0 / self.radii**2
        return np.maximum(squared, 0.0, out=squared)

    def _kernel(self, points: Array) -> tuple[Array, Array, Array]:
        """Kernel values (N, n) up to a factor per point (phi does not feel it), widening (N,), its gradient (N, 3)."""
        kernel = self._exponents(points)
        lowest = kernel.min(1)
        np.subtract(lowest[:, None], kernel, out=kernel)  # in place: new memory costs as much as the exponentials
        np.exp(kernel, out=kernel)
        total = kernel.sum(1)
        excess = np.maximum(lowest - np.log(total) - WIDEN_FROM, 0.0)
        widening = 1.0 + excess**2 / (WIDEN_OVER * (excess + WIDEN_OVER))
        slope = np.zeros_like(points)
        far = np.flatnonzero(excess > 0)
        if len(far):
            share = kernel[far] / total[far, None] * (2.0 / self.radii**2)
            soft = share.sum(1)[:, None] * points[far] - share @ self.nodes  # gradient of the soft minimum
            e = excess[far]
            slope[far] = (e * (e + 2 * WIDEN_OVER) / (WIDEN_OVER * (e + WIDEN_OVER) ** 2))[:, None] * soft
            kernel[far] = np.exp((lowest[far, None] - self._exponents(points[far])) / widening[far, None])
        return kernel, widening, slope

    def _kernel_derivatives(self, points: Array, kernel: Array, widening: Array, slope: Array) -> Iterator[Array]:
        """For m = 0, 1, 2 the derivative (N, n) of exp(-e / w) along x_m (the factor per point held fixed)."""
        narrow = kernel * (2.0 / self.radii**2)
        stretch = kernel * self._exponents(points) if slope.any() else None
        for m in range(3):
            derivative = self.nodes[None, :, m] - points[:, m : m + 1]
            derivative *= narrow
            if stretch is not None:
                derivative /= widening[:, None]
                derivative += stretch * (slope[:, m] / widening**2)[:, None]
            yield derivative

    def _slope_sums(self, shapes: Array, points: Array, widening: Array, slope: Array, columns: Array) -> Array:
        """sum_I phi_I (d log f_I / d x_m) columns_I for m = 0, 1, 2: (N, 3, k), from shapes phi_I (N, n).

        d log f_I / d x_m = 2 (x_I - x)_m / (w r_I^2), so products with columns scaled by nodes and radii are enough.
        """
        k, narrow = columns.shape[1], columns * (2.0 / self.radii**2)[:, None]
        scaled = np.concatenate([narrow, *(narrow * self.nodes[:, m : m + 1] for m in range(3))], axis=1)
        products = (shapes @ scaled).reshape(-1, 4, k)
        sums = products[:, 1:]
        sums -= products[:, :1] * points[:, :, None]
        far = np.flatnonzero(slope.any(axis=1))
        if len(far):
            stretch = (shapes[far] * self._exponents(points[far])) @ columns
            sums[far] /= widening[far, None, None]
            sums[far] += (slope[far] / widening[far, None] ** 2)[:, :, None] * stretch[:, None, :]
        return sums

    def _moment_columns(self, coefficients: Array) -> Array:
        """Columns that turn kernel values into M (16) and the loads sum_I f_I p_I c_I (4 k): (n, 16 + 4 k)."""
        p = _affine(self.nodes)
        return np.concatenate([_outer(p), (p[:, :, None] * coefficients[:, None, :]).reshape(len(p), -1)], axis=1)


def _affine(points: Array) -> Array:
    return np.concatenate([np.ones((len(points), 1)), points], axis=1)


def _outer(p: Array) -> Array:
    """Columns (n, 16) of p p^T."""
    return (p[:, :, None] * p[:, None, :]).reshape(len(p), 16)


def _split(moments: Array, k: int) -> tuple[Array, Array]:
    return moments[:, :16].reshape(-1, 4, 4), moments[:, 16:].reshape(-1, 4, k)
