"""Lowest linear elastic modes of a body in the space of its RKPM kernels, held by its pins.

Skinning weights are eigenfunctions of a scalar problem that knows neither Poisson's ratio nor pins: a basis of these
alone bends far too stiffly near incompressibility. Each component of an elastic mode is a scalar function as well, so
it can be used in all three directions like a skinning weight, which keeps the basis closed under rotations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..basis.reproducing_kernel import ReproducingKernel
from ..ground.checks import Array
from ..mechanics.neo_hookean import lame_constants
from .quadrature import Quadrature

CHUNK = 1024


@dataclass(frozen=True)
class ModeSpace:
    """Stiffness (3k, 3k) N/m, in the order node, axis, and mean mass matrix (k, k) of the k kernel functions."""

    kernel: ReproducingKernel
    stiffness: Array
    mass: Array

    def components(self, count: int, points: Array, springs: Array) -> Array:
        """Node coefficients (k, 3 count) of the components of the ``count`` lowest modes, the softest first.

        points (N, 3) in the kernels' frame are held by springs (N,) N/m.
        """
        shapes = self.kernel.shapes_with_gradient(points)[0] if len(points) else np.zeros((0, len(self.mass)))
        held = np.kron(shapes.T @ (springs[:, None] * shapes), np.eye(3))
        modes = lowest_modes(self.stiffness + held, self.mass, count)
        components: Array = modes.T.reshape(count, -1, 3).transpose(1, 0, 2).reshape(len(self.mass), -1)
        return components


def lowest_modes(stiffness: Array, mass: Array, count: int) -> Array:
    """The ``count`` lowest modes (3k, count) of K v = w M v, K (3k, 3k) in the order node, axis, M = mass (k, k) times
    the identity of the axes.

    In numpy, which lets other threads run meanwhile: scipy's eigh would stop Slicer's window for a third of a second.
    """
    k = len(mass)
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    half = (inverse @ stiffness.reshape(k, -1)).reshape(3 * k, k, 3)
    whole = np.einsum("rja,ij->ria", half, inverse, optimize=True).reshape(3 * k, 3 * k)
    vectors = np.linalg.eigh(whole)[1][:, :count]
    modes: Array = (inverse.T @ vectors.reshape(k, -1)).reshape(3 * k, count)
    return modes


def mode_space(kernel: ReproducingKernel, cells: Quadrature, length: float, youngs_pa: float, nu: float) -> ModeSpace:
    """Linear elasticity of the kernels, whose frame is x / ``length``; cells: points in that frame, volumes in m^3."""
    count = len(kernel.nodes)
    product, mass = np.zeros((3, 3, count, count)), np.zeros((count, count))
    for start in range(0, len(cells.points), CHUNK):
        weights = cells.weights[start : start + CHUNK]
        shapes, slopes = kernel.shapes_with_gradient(cells.points[start : start + CHUNK])
        mass += shapes.T @ (weights[:, None] * shapes)
        slopes /= length
        for m in range(3):
            scaled = weights[:, None] * slopes[m]
            for k in range(m, 3):
                product[m, k] += scaled.T @ slopes[k]
    for m, k in ((1, 0), (2, 0), (2, 1)):
        product[m, k] = product[k, m].T
    mu, lam = lame_constants(youngs_pa, nu)
    shear = mu * (product[0, 0] + product[1, 1] + product[2, 2])
    out = np.empty((count, 3, count, 3))
    for a in range(3):
        for b in range(3):
            out[:, a, :, b] = lam * product[a, b] + mu * product[b, a] + (shear if a == b else 0.0)
    mass /= cells.weights.sum()
    mass[np.diag_indices(count)] += 1e-10 * np.trace(mass) / count  # nodes that no point sees
    return ModeSpace(kernel, out.reshape(3 * count, 3 * count), mass)
