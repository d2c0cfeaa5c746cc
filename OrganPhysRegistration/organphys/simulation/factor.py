"""A reused Cholesky factor as preconditioner: a past stiffness, turned with the body, plus the present contacts.

A body turned as a whole by R has the Hessian it had before, turned by R: so the factor of one reference state serves
every orientation. It only speeds up the linear solves, whose residual is measured with the true Hessian: reusing it
costs no accuracy. When it has cost more conjugate gradient steps than a new one would, the reference is renewed.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from ..ground.checks import Array
from .body import Body
from .incremental_potential import Evaluation, IncrementalPotential

KEPT = 8
FEW, WORTH = 4, 60  # conjugate gradient steps per time step that are fine; so many more are worth a new factor


@dataclass(frozen=True)
class Factor:
    """Lower Cholesky factor (3n, 3n) of the Hessian of a body turned back by ``rotation`` (3, 3)."""

    lower: Array
    rotation: Array

    def solve(self, residual: Array) -> Array:
        """Approximate inverse Hessian times residual (n, 3)."""
        own = np.ascontiguousarray(residual @ self.rotation).ravel()
        solved: Array = lapack.dpotrs(self.lower, own, lower=1)[0].reshape(-1, 3) @ self.rotation.T
        return solved


class Base(NamedTuple):
    """Hessian (3n, 3n) of a body without contacts at a reference, its factor, and the body's rotation (3, 3) there."""

    body: Body
    reference: Array
    matrix: Array
    lower: Array
    rotation: Array


class FactorCache:
    """Keeps the base matrices of a few bodies and step sizes; what comes out depends on the arguments alone."""

    def __init__(self) -> None:
        self._bases: OrderedDict[tuple[int, int, float, float], Base] = OrderedDict()

    def factor(self, potential: IncrementalPotential, at: Evaluation, reference: Array) -> Factor:
        """Preconditioner for the Hessian at ``at`` from the stiffness at ``reference`` (n, 3)."""
        base = self._base(potential, reference)
        rotation = mean_rotation(potential.body, at.deformation) @ base.rotation.T
        if at.contact is None:
            return Factor(base.lower, rotation)
        return Factor(_cholesky(base.matrix + _contact_matrix(potential, at, rotation)), rotation)

    def _base(self, potential: IncrementalPotential, reference: Array) -> Base:
        viscous = 1.0 if potential.viscosity is None else 1.0 + potential.viscosity.factor
        inertia = potential.inertia + potential.drag
        key = (id(potential.body), id(reference), inertia, viscous)
        if key not in self._bases:  # body and reference are kept, so their ids stay their own
            self._bases[key] = _base(potential.body, reference, inertia, viscous)
            if len(self._bases) > KEPT:
                self._bases.popitem(last=False)
        self._bases.move_to_end(key)
        return self._bases[key]


def renewed(reference: Array, excess: int, z: Array, cg_steps: int) -> tuple[Array, int]:
    """Reference (n, 3) and excess for the next step, after one that took ``cg_steps`` and ended at Z (n, 3)."""
    excess += max(cg_steps - FEW, 0)
    return (z, 0) if excess > WORTH else (reference, excess)


def _base(body: Body, reference: Array, inertia: float, viscous: float) -> Base:
    elasticity, rotation = body.elasticity, np.eye(3)
    if reference.any():
        stiffness = elasticity.hessian(reference)
        rotation = mean_rotation(body, body.strain.gradients(reference))
    else:
        stiffness = elasticity.rest_hessian()
    rest = np.kron(body.held, np.eye(3))
    rest[np.diag_indices(len(rest))] += inertia
    matrix = viscous * stiffness + rest
    lower, info = lapack.dpotrf(matrix, lower=1, clean=0)
    if info != 0:  # tissue under pressure is about to buckle
        matrix = viscous * elasticity.hessian(reference, project=True) + rest
        lower = _cholesky(matrix)
    return Base(body, reference, matrix, lower, rotation)


def mean_rotation(body: Body, deformation: Array) -> Array:
    """Rotation (3, 3) of the mean deformation gradient, by polar decomposition."""
    u, _, vt = np.linalg.svd(deformation @ body.strain.weights)
    return (u * np.array([1.0, 1.0, np.linalg.det(u @ vt)])) @ vt


def _contact_matrix(potential: IncrementalPotential, at: Evaluation, rotation: Array) -> Array:
    """Contact Hessian (3n, 3n) in the frame of the body."""
    assert potential.contact is not None and at.contact is not None
    active = np.flatnonzero(at.contact.blocks.any(axis=(1, 2)))
    phi, blocks = potential.contact.phi[active], rotation.T @ at.contact.blocks[active] @ rotation
    n = phi.shape[1]
    out = np.empty((n, 3, n, 3))
    for a in range(3):
        for b in range(a, 3):
            block = phi.T @ (blocks[:, a, b, None] * phi)
            out[:, a, :, b] = block
            out[:, b, :, a] = block.T
    return out.reshape(3 * n, 3 * n)


def _cholesky(matrix: Array) -> Array:
    lower, info = lapack.dpotrf(matrix, lower=1, clean=0)
    if info != 0:
        raise ValueError(
            f"preconditioner: not positive definite (LAPACK info {info}); are stiffness and mass positive?"
        )
    return lower
