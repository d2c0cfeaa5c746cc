"""Two Neo-Hookean energy densities with the true Lame constants at rest, vectorised over points.

Both have the form Psi(F) = mu/2 (tr F^T F - 3) + g(J), J = det F, and differ in g only, so that stress and Hessian
need g' and g'' alone. F (Q, 3, 3) has row a = direction in space and column m = direction in the material; the
Hessian (Q, 9, 9) orders its entries as 3 a + m. Densities carry the unit of the Lame constants (Pa = J/m^3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..ground.checks import Array, InputError, as_positive
from .determinant import cofactor, cofactor_derivative

Material = TypeVar("Material", bound="NeoHookean")


@dataclass(frozen=True)
class NeoHookean:
    """Lame constants ``mu`` (shear modulus) and ``lam`` of an isotropic material; use one of the subclasses."""

    mu: float
    lam: float

    def __post_init__(self) -> None:
        as_positive(self.mu, "shear modulus mu")
        if not np.isfinite(self.lam) or self.lam < 0:
            raise InputError(f"Lame constant lam: expected a finite number of at least 0, got {self.lam}")

    @classmethod
    def from_youngs(cls: type[Material], youngs_modulus: float, poissons_ratio: float) -> Material:
        """Material from Young's modulus E (Pa) and Poisson's ratio nu in [0, 0.5)."""
        mu, lam = lame_constants(youngs_modulus, poissons_ratio)
        return cls(mu, lam)

    def volumetric(self, volume_ratio: Array) -> tuple[Array, Array, Array]:
        """g(J), g'(J), g''(J), each (Q,)."""
        raise NotImplementedError

    def energy(self, gradient: Array) -> Array:
        """Energy density (Q,) at deformation gradients F (Q, 3, 3)."""
        return self.energy_and_stress(gradient)[0]

    def energy_and_stress(self, gradient: Array) -> tuple[Array, Array]:
        """Energy density (Q,) and first Piola-Kirchhoff stress dPsi/dF (Q, 3, 3)."""
        energy, stress = self.components_energy_and_stress(np.ascontiguousarray(gradient.transpose(1, 2, 0)))
        return energy, stress.transpose(2, 0, 1)

    def components_energy_and_stress(self, gradient: Array) -> tuple[Array, Array]:
        """The same with the points last, F (3, 3, Q): contiguous components make it several times faster."""
        cof = cofactor(gradient)
        volume_ratio = (gradient[0] * cof[0]).sum(0)
        g, slope, _ = self.volumetric(volume_ratio)
        flat = gradient.reshape(9, -1)
        energy = 0.5 * self.mu * (np.einsum("kq,kq->q", flat, flat) - 3.0) + g
        cof *= slope
        cof += self.mu * gradient
        return energy, cof

    def hessian(self, gradient: Array, *, project: bool) -> Array:
        """Second derivative (Q, 9, 9) of the density; ``project`` clamps its eigenvalues at zero (PSD)."""
        components = np.ascontiguousarray(gradient.transpose(1, 2, 0))
        cof = cofactor(components)
        _, slope, curvature = self.volumetric((components[0] * cof[0]).sum(0))
        c = cof.reshape(9, -1).T
        hessian = slope[:, None, None] * cofactor_derivative(gradient)
        hessian += (curvature[:, None] * c)[:, :, None] * c[:, None, :]
        hessian[:, np.arange(9), np.arange(9)] += self.mu
        return project_to_psd(hessian) if project else hessian


class StableNeoHookean(NeoHookean):
    """Psi = mu/2 (tr F^T F - 3) - mu (J - 1) + (lam + mu)/2 (J - 1)^2: finite for every F, also inverted ones.

    Smith, de Goes, Kim, "Stable Neo-Hookean Flesh Simulation", ACM TOG 2018 (without the rest stabilisation), its
    volume constant raised by mu so that ``lam`` is the Lame constant of the linearised material.
    """

    def volumetric(self, volume_ratio: Array) -> tuple[Array, Array, Array]:
        j, bulk = volume_ratio - 1.0, self.lam + self.mu
        return j * (0.5 * bulk * j - self.mu), bulk * j - self.mu, np.full_like(j, bulk)


class LogNeoHookean(NeoHookean):
    """Psi = mu/2 (tr F^T F - 3 - 2 ln J) + lam/2 (J - 1)^2: infinite as J -> 0, +inf at J <= 0.

    Bonet and Wood, "Nonlinear Continuum Mechanics for Finite Element Analysis", 2nd ed., section 6.4.3, with the
    volume term in J - 1. Where J <= 0 the stress is finite but means nothing.
    """

    def volumetric(self, volume_ratio: Array) -> tuple[Array, Array, Array]:
        valid = volume_ratio > 0
        safe = np.where(valid, volume_ratio, 1.0)
        j = safe - 1.0
        g = np.where(valid, 0.5 * self.lam * j * j - self.mu * np.log(safe), np.inf)
        return g, self.lam * j - self.mu / safe, self.lam + self.mu / safe**2


def lame_constants(youngs_modulus: float, poissons_ratio: float) -> tuple[float, float]:
    """Lame constants (mu, lam) from Young's modulus (Pa) and Poisson's ratio in [0, 0.5); same unit as E."""
    e, nu = as_positive(youngs_modulus, "Young's modulus"), float(poissons_ratio)
    if not 0 <= nu < 0.5:
        raise InputError(f"Poisson's ratio: expected at least 0 and below 0.5, got {poissons_ratio}")
    return e / (2 * (1 + nu)), e * nu / ((1 + nu) * (1 - 2 * nu))


def project_to_psd(matrices: Array) -> Array:
    """Nearest positive semi-definite matrices (Q, k, k) to symmetric ones: negative eigenvalues become zero."""
    values, vectors = np.linalg.eigh(matrices)
    return (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1)
