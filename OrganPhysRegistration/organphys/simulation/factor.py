"""A reused Cholesky factor as preconditioner: a past stiffness, turned with the body, plus the present contacts.

A body turned as a whole by R has the Hessian it had before, turned by R: so the factor of one reference state serves
every orientation. It only speeds up the linear solves, whose residual is measured with the true Hessian: reusing it
costs no accuracy. When it has cost more conjugate gradient steps than a new one would, the reference is renewed.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.linalg import lapack

from ..ground.checks import Array
from .body import Body
from .incremental_potential import Evaluation, IncrementalPotential
from .stiffness_matrix import stiffness_matrix

Key = TypeVar("Key", bound=Hashable)
Value = TypeVar("Value")

KEPT = 12
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


class Stiffness(NamedTuple):
    """Elastic Hessian (3n, 3n) of a body at a reference (n, 3) and the rotation (3, 3) of the body there."""

    body: Body
    reference: Array
    matrix: Array
    rotation: Array


class Base(NamedTuple):
    """Hessian (3n, 3n) without contacts of one step size, its factor, and where its stiffness is from."""

    matrix: Array
    lower: Array
    stiffness: Stiffness


class FactorCache:
    """Keeps the matrices of a few bodies and step sizes; what comes out depends on the arguments alone."""

    def __init__(self) -> None:
        self._stiffness: OrderedDict[tuple[int, int], Stiffness] = OrderedDict()
        self._bases: OrderedDict[tuple[int, int, float, float], Base] = OrderedDict()

    def factor(self, potential: IncrementalPotential, at: Evaluation, reference: Array) -> Factor:
        """Preconditioner for the Hessian at ``at`` from the stiffness at ``reference`` (n, 3)."""
        base = self._base(potential, reference)
        if at.contact is None:
            return Factor(base.lower, self._turn(potential, at, base))
        matrix, rotation = self.matrix(potential, at, reference)
        return Factor(cholesky(matrix), rotation)

    def matrix(self, potential: IncrementalPotential, at: Evaluation, reference: Array) -> tuple[Array, Array]:
        """What is factorised: the Hessian (3n, 3n) of the body turned back by a rotation (3, 3), and that."""
        base = self._base(potential, reference)
        rotation = self._turn(potential, at, base)
        if at.contact is None:
            return base.matrix, rotation
        return base.matrix + _contact_matrix(potential, at, rotation), rotation

    @staticmethod
    def _turn(potential: IncrementalPotential, at: Evaluation, base: Base) -> Array:
        turn: Array = mean_rotation(potential.body, at.deformation) @ base.stiffness.rotation.T
        return turn

    def _base(self, potential: IncrementalPotential, reference: Array) -> Base:
        body, inertia = potential.body, potential.inertia + potential.drag
        viscous = 1.0 if potential.viscosity is None else 1.0 + potential.viscosity.factor
        key = (id(body), id(reference))  # what is kept holds body and reference, so their ids stay their own
        stiffness = _kept(self._stiffness, key, lambda: _stiffness(body, reference))
        return _kept(self._bases, (*key, inertia, viscous), lambda: _base(stiffness, inertia, viscous))


def _kept(store: OrderedDict[Key, Value], key: Key, make: Callable[[], Value]) -> Value:
    """The value of ``key``, made if it is not there; the values used longest ago are dropped."""
    if key not in store:
        store[key] = make()
        if len(store) > KEPT:
            store.popitem(last=False)
    store.move_to_end(key)
    return store[key]


def renewed(reference: Array, excess: int, z: Array, cg_steps: int) -> tuple[Array, int]:
    """Reference (n, 3) and excess for the next step, after one that took ``cg_steps`` and ended at Z (n, 3)."""
    excess += max(cg_steps - FEW, 0)
    return (z, 0) if excess > WORTH else (reference, excess)


def _stiffness(body: Body, reference: Array) -> Stiffness:
    if not reference.any():
        return Stiffness(body, reference, body.elasticity.rest_hessian(), np.eye(3))
    rotation = mean_rotation(body, body.strain.gradients(reference))
    return Stiffness(body, reference, stiffness_matrix(body.strain, reference), rotation)


def _base(stiffness: Stiffness, inertia: float, viscous: float) -> Base:
    body = stiffness.body
    rest = np.kron(body.held, np.eye(3))
    rest[np.diag_indices(len(rest))] += inertia
    matrix = viscous * stiffness.matrix + rest
    lower, info = lapack.dpotrf(matrix, lower=1, clean=0)
    if info != 0:  # tissue under pressure is about to buckle
        matrix = viscous * stiffness_matrix(body.strain, stiffness.reference, definite=True) + rest
        lower = cholesky(matrix)
    return Base(matrix, lower, stiffness)


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


def cholesky(matrix: Array) -> Array:
    """Lower Cholesky factor; ValueError if the matrix is not positive definite."""
    lower, info = lapack.dpotrf(matrix, lower=1, clean=0)
    if info != 0:
        raise ValueError(
            f"preconditioner: not positive definite (LAPACK info {info}); are stiffness and mass positive?"
        )
    return lower
