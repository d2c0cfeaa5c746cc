"""A reused Cholesky factor as preconditioner: rest stiffness, turned with the body, plus the present contacts.

A reduced basis turns with the body: at Z' = Z R^T + (R - I) the Hessian is that at Z turned by R. The factor is made in
the body's frame, so it serves every orientation. It only speeds up the linear solves, whose error is measured with
the true Hessian; reusing it costs no accuracy.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from ..ground.checks import Array
from .body import Body
from .incremental_potential import Evaluation, IncrementalPotential

KEPT = 8


@dataclass(frozen=True)
class Factor:
    """Lower Cholesky factor (3n, 3n) in the frame of the body, which is turned by ``rotation`` (3, 3)."""

    lower: Array
    rotation: Array

    def solve(self, residual: Array) -> Array:
        """Approximate inverse Hessian times residual (n, 3)."""
        own = np.ascontiguousarray(residual @ self.rotation).ravel()
        solved: Array = lapack.dpotrs(self.lower, own, lower=1)[0].reshape(-1, 3) @ self.rotation.T
        return solved


class FactorCache:
    """Keeps the base matrices of a few bodies and step sizes; what comes out depends on the arguments alone."""

    def __init__(self) -> None:
        self._bases: OrderedDict[tuple[int, float, float], tuple[Body, Array, Array]] = OrderedDict()

    def factor(self, potential: IncrementalPotential, at: Evaluation) -> Factor:
        """Preconditioner for the Hessian at ``at``."""
        rotation = mean_rotation(potential.body, at.deformation)
        base, lower = self._base(potential)
        if at.contact is None:
            return Factor(lower, rotation)
        return Factor(_cholesky(base + _contact_matrix(potential, at, rotation)), rotation)

    def _base(self, potential: IncrementalPotential) -> tuple[Array, Array]:
        viscous = 1.0 if potential.viscosity is None else 1.0 + potential.viscosity.factor
        key = (id(potential.body), potential.inertia + potential.drag, viscous)
        if key not in self._bases:
            base = viscous * potential.body.rest_stiffness
            base += np.kron(potential.body.held, np.eye(3))
            base[np.diag_indices(len(base))] += potential.inertia + potential.drag
            self._bases[key] = (potential.body, base, _cholesky(base))  # the body is kept: its id stays its own
            if len(self._bases) > KEPT:
                self._bases.popitem(last=False)
        self._bases.move_to_end(key)
        return self._bases[key][1:]


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
