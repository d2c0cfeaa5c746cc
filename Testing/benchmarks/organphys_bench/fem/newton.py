"""Projected Newton on nodal displacements and, where it is free, the joint scale gamma.

Minimised: alpha E(u) + sum_k |x_k - gamma a_k|^2 in a metric each + linear gamma; the matrix is that of the mesh with
one border for gamma, so that a step takes one sparse factorisation and two solves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import eye_array
from scipy.sparse.linalg import splu

from organphys.ground.checks import Array
from organphys.mechanics.line_search import backtrack

from .assembly import Elasticity, spring_entries, spring_forces
from .organ_mesh import Carried

SHIFT = 1e-9  # of the mean diagonal: nodes that no data holds must not make the matrix singular


@dataclass(frozen=True)
class Springs:
    """Points at rest (K, 3) carried by the mesh, pulled to gamma times ``targets`` (K, 3) in ``metric`` (K, 3, 3);
    ``linear``: added to the gradient in gamma; ``scale``: gamma is free."""

    carried: Carried
    rest: Array
    targets: Array
    metric: Array
    linear: float = 0.0
    scale: bool = False

    def residual(self, elastic: Elasticity, u: Array, gamma: float) -> Array:
        return self.rest + elastic.assembly.mesh.moved(self.carried, u) - gamma * self.targets


def minimise(
    elastic: Elasticity, alpha: float, springs: Springs, u: Array, gamma: float, *, steps: int, tolerance: float
) -> tuple[Array, float, int]:
    """u (N, 3), gamma and Newton steps taken; ends when the predicted decrease is below ``tolerance``."""
    entries = spring_entries(elastic.assembly, springs.carried, springs.metric)
    pull = np.einsum("kab,kb->ka", springs.metric, springs.targets)
    border = -2 * spring_forces(elastic.assembly, springs.carried, pull)
    corner = 2 * float((springs.targets * pull).sum())

    def objective(q: Array) -> tuple[float, Array]:
        at = q[:-1].reshape(-1, 3)
        energy, gradient = elastic.energy_and_gradient(at)
        residual = springs.residual(elastic, at, q[-1])
        force = np.einsum("kab,kb->ka", springs.metric, residual)
        slope = alpha * gradient + 2 * spring_forces(elastic.assembly, springs.carried, force)
        in_gamma = -2 * float((springs.targets * force).sum()) + springs.linear if springs.scale else 0.0
        value = alpha * energy + float((residual * force).sum()) + springs.linear * q[-1]
        return value, np.append(slope, in_gamma)

    q = np.append(u.ravel(), gamma)
    value, slope = objective(q)
    for step in range(steps):
        stiffness = entries + alpha * elastic.hessian_entries(q[:-1].reshape(-1, 3))
        way = direction(elastic, stiffness, border if springs.scale else None, corner, slope)
        if -0.5 * float(way @ slope) < tolerance:
            return q[:-1].reshape(-1, 3), float(q[-1]), step
        accepted = backtrack(objective, q, value, slope, way)
        if not accepted.found:
            return q[:-1].reshape(-1, 3), float(q[-1]), step + 1
        q, value, slope = accepted.x, accepted.energy, accepted.gradient
    return q[:-1].reshape(-1, 3), float(q[-1]), steps


def direction(elastic: Elasticity, entries: Array, border: Array | None, corner: float, slope: Array) -> Array:
    """Newton direction (3N + 1,) for stored entries of the matrix and its border; without one gamma stays."""
    matrix = elastic.assembly.matrix(entries)
    matrix = matrix + SHIFT * matrix.diagonal().mean() * eye_array(matrix.shape[0], format="csc")
    factor = splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    if border is None:
        return np.append(-factor.solve(slope[:-1]), 0.0)
    free, along = factor.solve(np.column_stack([slope[:-1], border])).T
    in_gamma = -(slope[-1] - border @ free) / max(corner - float(border @ along), 1e-12 * corner)
    return np.append(-free - in_gamma * along, in_gamma)
