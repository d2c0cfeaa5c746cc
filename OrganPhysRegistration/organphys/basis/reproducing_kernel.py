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
        outer = (p[:, :, None] * p[:, None, :]).reshape(len(p), 16)
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
        """sum_I phi_I(x) c_I at points (N, 3) for node coefficients (n, k): (N, k), without forming phi."""
        moments = self._kernel(points)[0] @ self._moment_columns(coefficients)
        matrix, load = _split(moments, coefficients.shape[1])
        solved = np.linalg.solve(matrix, _affine(points)[:, :, None])
        return (solved.transpose(0, 2, 1) @ load)[:, 0]

    def combined_with_gradient(self, coefficients: Array, points: Array) -> tuple[Array, Array]:
        """The same and its derivative: (N, k), (N, k, 3)."""
        kernel, widening, slope = self._kernel(points)
        columns, k = self._moment_columns(coefficients), coefficients.shape[1]
        matrix, load = _split(kernel @ columns, k)
        inverse = np.linalg.inv(matrix)
        row = (inverse @ _affine(points)[:, :, None])[:, None, :, 0]
        gradients = np.empty((len(points), k, 3))
        for m, moments in enumerate(self._moment_derivatives(points, kernel, widening, slope, columns)):
            d_matrix, d_load = _split(moments, k)
            right = -(row @ d_matrix)
            right[:, 0, m + 1] += 1.0
            gradients[:, :, m] = (right @ inverse @ load + row @ d_load)[:, 0]
        return (row @ load)[:, 0], gradients

    def _exponents(self, points: Array) -> Array:
        """|x - x_I|^2 / r_I^2, (N, n)."""
        squared = points @ (-2.0 * self.nodes.T)
        squared += (self.nodes**2).sum(1)
        squared += (points**2).sum(1)[:, None]
        squared *= 1.0 / self.radii**2
        return np.maximum(squared, 0.0, out=squared)

    def _kernel(self, points: Array) -> tuple[Array, Array, Array]:
        """Kernel values (N, n) up to a factor per point (phi does not feel it), widening (N,), its gradient (N, 3)."""
        exponents = self._exponents(points)
        lowest = exponents.min(1)
        kernel = np.exp(lowest[:, None] - exponents)
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
            kernel[far] = np.exp((lowest[far, None] - exponents[far]) / widening[far, None])
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

    def _moment_derivatives(
        self, points: Array, kernel: Array, widening: Array, slope: Array, columns: Array
    ) -> Iterator[Array]:
        """For m = 0, 1, 2 the derivative of ``kernel @ columns`` along x_m, without forming that of the kernel.

        d f_I / d x_m = 2 (x_I - x)_m / (w r_I^2) f_I, so products with columns scaled by nodes and radii are enough.
        """
        narrow = columns * (2.0 / self.radii**2)[:, None]
        total = kernel @ narrow
        far = np.flatnonzero(slope.any(axis=1))
        stretch = (kernel[far] * self._exponents(points[far])) @ columns
        for m in range(3):
            derivative = kernel @ (narrow * self.nodes[:, m : m + 1])
            derivative -= total * points[:, m : m + 1]
            derivative[far] /= widening[far, None]
            derivative[far] += stretch * (slope[far, m] / widening[far] ** 2)[:, None]
            yield derivative

    def _moment_columns(self, coefficients: Array) -> Array:
        """Columns that turn kernel values into M (16) and the loads sum_I f_I p_I c_I (4 k): (n, 16 + 4 k)."""
        p = _affine(self.nodes)
        outer = (p[:, :, None] * p[:, None, :]).reshape(len(p), 16)
        return np.concatenate([outer, (p[:, :, None] * coefficients[:, None, :]).reshape(len(p), -1)], axis=1)


def _affine(points: Array) -> Array:
    return np.concatenate([np.ones((len(points), 1)), points], axis=1)


def _split(moments: Array, k: int) -> tuple[Array, Array]:
    return moments[:, :16].reshape(-1, 4, 4), moments[:, 16:].reshape(-1, 4, k)
