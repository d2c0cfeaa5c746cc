"""Elastic energy and viscous dissipation of a body at its quadrature points, with gradient and Hessian product.

F = I + sum_i Z_i (grad Phi_i)^T. Arrays of deformation gradients keep the points last, (3 a, 3 m, Q): a row in space,
m in the material. Viscosity is that of a Kelvin-Voigt solid whose stiffness is the rest stiffness: Rayleigh's
stiffness damping, in a form that rigid rotations do not feel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..mechanics.determinant import cofactor
from ..mechanics.neo_hookean import NeoHookean

Single = NDArray[np.float32]
Numbers = NDArray[np.floating]


class Viscosity(NamedTuple):
    """Factor beta / h (1), gradients F (3, 3, Q) that the rate is measured in and F of the scheme's old position."""

    factor: float
    start: Array
    old: Array


class Tangent(NamedTuple):
    """What a Hessian product needs, in single precision: cofactor (3, 3, Q), slope and curvature (Q,) of the volume
    term, F and F at the start of the step (3, 3, Q), factor of the viscosity."""

    cofactor: Single
    slope: Single
    curvature: Single
    gradient: Single
    start: Single
    viscous: float


@dataclass(frozen=True)
class StrainEnergy:
    """rows (3 Q, n): derivatives of Phi per metre in the order (m, q) at points (Q, 3) m with weights (Q,) m^3."""

    rows: Array
    points: Array
    weights: Array
    material: NeoHookean

    def gradients(self, z: Array) -> Array:
        """Deformation gradients (3, 3, Q) at Z (n, 3)."""
        f = self.rates(z)
        f[[0, 1, 2], [0, 1, 2]] += 1.0
        return f

    def rates(self, z: Array) -> Array:
        """Linear part of the deformation gradients (3, 3, Q), without the identity."""
        return _times(self._columns, z).astype(np.float64, copy=False)

    def loads(self, stress: Array) -> Array:
        """Nodal forces (n, 3) of stresses (3, 3, Q): sum over the points of weight * stress : dF/dZ."""
        return self._columns @ (stress * self.weights).reshape(3, -1).T

    def energy_and_stress(self, f: Array, viscosity: Viscosity | None) -> tuple[float, Array]:
        """Energy in J (infinite where det F <= 0) and stress dE/dF (3, 3, Q) in Pa."""
        density, stress = self.material.components_energy_and_stress(f)
        energy = float(density @ self.weights)
        if viscosity is not None:
            rate = _right_product(viscosity.start, f - viscosity.old)
            viscous = self._viscous(rate)
            energy += 0.5 * viscosity.factor * float(np.einsum("amq,amq,q->", rate, viscous, self.weights))
            stress += viscosity.factor * _product(viscosity.start, viscous)
        return energy, stress

    def tangent(self, f: Array, viscosity: Viscosity | None) -> Tangent:
        """Coefficients of the Hessian at F, without projection."""
        cof = cofactor(f)
        _, slope, curvature = self.material.volumetric((f[0] * cof[0]).sum(0))
        factor, start = (0.0, f) if viscosity is None else (viscosity.factor, viscosity.start)
        single = [part.astype(np.float32) for part in (cof, slope, curvature, f, start)]
        return Tangent(single[0], single[1], single[2], single[3], single[4], factor)

    def hessian_product(self, tangent: Tangent, change: Array) -> Array:
        """Second derivative of the energy times ``change`` (n, 3), to single precision: (n, 3)."""
        df = _times(self._columns32, change.astype(np.float32))
        out = np.float32(self.material.mu) * df
        out += tangent.slope * _cofactor_change(tangent.gradient, df)
        out += (tangent.curvature * np.einsum("amq,amq->q", tangent.cofactor, df)) * tangent.cofactor
        if tangent.viscous:
            viscous = self._viscous(_right_product(tangent.start, df))
            out += np.float32(tangent.viscous) * _product(tangent.start, viscous)
        out *= self._weights32
        return (self._columns32 @ out.reshape(3, -1).T).astype(np.float64)

    @cached_property
    def rows32(self) -> Single:
        """``rows`` in single precision."""
        return self.rows.astype(np.float32)

    @cached_property
    def _columns(self) -> Array:
        """``rows`` turned over, (n, 3 Q): products with three columns are several times quicker in this order."""
        return np.ascontiguousarray(self.rows.T)

    @cached_property
    def _columns32(self) -> Single:
        return self._columns.astype(np.float32)

    @cached_property
    def _weights32(self) -> Single:
        return self.weights.astype(np.float32)

    def determinants(self, z: Array) -> Array:
        """det F (Q,) at Z (n, 3)."""
        f = self.gradients(z)
        return (f[0] * cofactor(f)[0]).sum(0)

    def _viscous(self, rate: Numbers) -> Numbers:
        """2 mu sym(rate) + lam tr(rate) I, (3, 3, Q)."""
        mu, lam = rate.dtype.type(self.material.mu), rate.dtype.type(self.material.lam)
        out = mu * (rate + rate.transpose(1, 0, 2))
        out[[0, 1, 2], [0, 1, 2]] += lam * (rate[0, 0] + rate[1, 1] + rate[2, 2])
        return out


def _times(columns: Numbers, z: Numbers) -> Numbers:
    """(columns^T @ Z) as (3 a, 3 m, Q)."""
    product: Numbers = np.ascontiguousarray(z.T) @ columns
    return product.reshape(3, 3, -1)


def _cofactor_change(f: Single, df: Single) -> Single:
    """Derivative of the cofactor matrix at F along dF."""
    out = np.empty_like(f)
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            np.multiply(df[b, n], f[c, o], out=out[a, m])
            out[a, m] += f[b, n] * df[c, o]
            out[a, m] -= df[b, o] * f[c, n]
            out[a, m] -= f[b, o] * df[c, n]
    return out


def _product(a: Numbers, b: Numbers) -> Numbers:
    """a b at every point."""
    return np.einsum("akq,kmq->amq", a, b)


def _right_product(a: Numbers, b: Numbers) -> Numbers:
    """a^T b at every point."""
    return np.einsum("kaq,kmq->amq", a, b)
