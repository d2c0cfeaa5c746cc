"""Hyperelastic energy of the reduced deformation, with gradient and Hessian in Z.

F(X) = I + sum_i Z_i (grad Phi_i)^T, i.e. F[a, m] = delta + sum_i Z[i, a] G[m, i]; energy = sum_q weight_q Psi(F_q).
Rotation and translation live in the constant handle, which the energy does not feel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..ground.checks import Array
from ..mechanics.determinant import cofactor
from ..mechanics.neo_hookean import NeoHookean
from .reduced_basis import ReducedBasis


@dataclass(frozen=True)
class ReducedElasticity:
    """phi_gradient (3, Q, 4H), quadrature points (Q, 3) normalised, weights (Q,), material.

    The unit of the energy is that of material times weights: weights summing to 1 give a mean energy density.
    """

    phi_gradient: Array
    points: Array
    weights: Array
    material: NeoHookean

    @classmethod
    def at(cls, basis: ReducedBasis, points: Array, material: NeoHookean, *, volume: float = 1.0) -> ReducedElasticity:
        """Elasticity with equal quadrature weights volume / Q at points (Q, 3) of the normalised frame."""
        gradient = np.ascontiguousarray(basis.phi_and_gradient(points)[1])
        return cls(gradient, points, np.full(len(points), volume / len(points)), material)

    @cached_property
    def _rows(self) -> Array:
        """G with rows (m, q), shape (3Q, 4H): one matrix product gives all deformation gradients."""
        return np.ascontiguousarray(self.phi_gradient.reshape(-1, self.phi_gradient.shape[2]))

    def _components(self, z: Array) -> Array:
        """Deformation gradients with the points last, (3 a, 3 m, Q)."""
        gradient = (np.ascontiguousarray(z.T) @ self._rows.T).reshape(3, 3, -1)
        gradient[[0, 1, 2], [0, 1, 2]] += 1.0
        return gradient

    def deformation_gradient(self, z: Array) -> Array:
        """F (Q, 3, 3) at Z (4H, 3)."""
        return self._components(z).transpose(2, 0, 1)

    def min_det(self, z: Array) -> float:
        """Lowest det F over the quadrature points: at or below 0 the organ is turned inside out somewhere."""
        return float(self.determinants(z).min())

    def determinants(self, z: Array) -> Array:
        """det F (Q,), the local volume ratios."""
        components = self._components(z)
        return (components[0] * cofactor(components)[0]).sum(0)

    def energy(self, z: Array) -> float:
        """Energy at Z (4H, 3); +inf where the material says so."""
        return self.energy_and_gradient(z)[0]

    def energy_and_gradient(self, z: Array) -> tuple[float, Array]:
        """Energy and its derivative (4H, 3) with respect to Z."""
        energy, stress = self.material.components_energy_and_stress(self._components(z))
        stress *= self.weights
        return float(energy @ self.weights), (stress.reshape(3, -1) @ self._rows).T

    def hessian(self, z: Array, project: bool = False) -> Array:
        """Second derivative (12H, 12H) in the ordering of Z.ravel(); ``project``: positive semi-definite per point."""
        local = self.material.hessian(self.deformation_gradient(z), project=project)
        local *= self.weights[:, None, None]
        blocks = np.ascontiguousarray(local.reshape(-1, 3, 3, 3, 3).transpose(1, 3, 2, 4, 0))  # a, b, m, n, q
        n = self.phi_gradient.shape[2]
        out, scaled = np.empty((n, 3, n, 3)), np.empty_like(self.phi_gradient)
        for a in range(3):
            for b in range(a, 3):
                for m in range(3):
                    np.multiply(blocks[a, b, m, 0, :, None], self.phi_gradient[0], out=scaled[m])
                    for k in (1, 2):
                        scaled[m] += blocks[a, b, m, k, :, None] * self.phi_gradient[k]
                block = self._rows.T @ scaled.reshape(-1, n)
                out[:, a, :, b] = block
                out[:, b, :, a] = block.T
        return out.reshape(3 * n, 3 * n)

    def rest_hessian(self) -> Array:
        """Hessian at Z = 0, (12H, 12H): linear elasticity, from the six products G_m^T G_k alone."""
        n, g = self.phi_gradient.shape[2], self.phi_gradient
        scaled = g * self.weights[None, :, None]
        product = np.empty((3, 3, n, n))
        for m in range(3):
            for k in range(m, 3):
                product[m, k] = scaled[m].T @ g[k]
                product[k, m] = product[m, k].T
        mu, lam = self.material.mu, self.material.lam
        shear = mu * (product[0, 0] + product[1, 1] + product[2, 2])
        out = np.empty((n, 3, n, 3))
        for a in range(3):
            for b in range(3):
                out[:, a, :, b] = lam * product[a, b] + mu * product[b, a] + (shear if a == b else 0.0)
        return out.reshape(3 * n, 3 * n)
