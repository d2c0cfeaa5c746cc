"""Inverse of the deformation by damped Newton steps, every point for itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .deformation import Deformation

TOLERANCE_MM = 1e-6
STEPS = 30
LONGEST_STEP_MM = 20.0


@dataclass(frozen=True)
class InverseMap:
    """points (N, 3) CT mm, NaN rows where not converged; residual_mm (N,), what is left; converged (N,)."""

    points: Array
    residual_mm: Array
    converged: NDArray[np.bool_]


def invert(deformation: Deformation, targets: Array) -> InverseMap:
    """Points x with x + u(x) = target for targets (N, 3) in CT mm (similarity taken out).

    Newton steps halved until the residual falls. What has not converged then is started again from other points
    round the target; a target that the deformation covers twice or not at all (det F <= 0 nearby) may stay without.
    """
    x, residual = _newton(deformation, targets, targets.copy())
    for direction in np.concatenate([np.eye(3), -np.eye(3)]):
        left = np.flatnonzero(residual > TOLERANCE_MM)
        if not len(left):
            break
        again, rest = _newton(deformation, targets[left], targets[left] + 15.0 * direction)
        better = rest < residual[left]
        x[left[better]], residual[left[better]] = again[better], rest[better]
    converged = residual <= TOLERANCE_MM
    x[~converged] = np.nan
    return InverseMap(x, residual, converged)


def _newton(deformation: Deformation, targets: Array, start: Array) -> tuple[Array, Array]:
    """Points and residual lengths after at most STEPS damped Newton steps from ``start`` (changed in place)."""
    x = start
    u, gradient = deformation.displacement_and_gradient(x)
    error = x + u - targets
    size = np.linalg.norm(error, axis=1)
    damping = np.ones(len(x))
    for _ in range(STEPS):
        rows = np.flatnonzero((size > TOLERANCE_MM) & (damping > 1e-4))
        if not len(rows):
            break
        step = -damping[rows, None] * _solve(gradient[rows] + np.eye(3), error[rows])
        trial = x[rows] + step
        u, slope = deformation.displacement_and_gradient(trial)
        trial_error = trial + u - targets[rows]
        trial_size = np.linalg.norm(trial_error, axis=1)
        good = trial_size < (1 - 0.1 * damping[rows]) * size[rows]
        kept = rows[good]
        x[kept], error[kept], size[kept], gradient[kept] = trial[good], trial_error[good], trial_size[good], slope[good]
        damping[kept] = np.minimum(1.0, 2 * damping[kept])
        damping[rows[~good]] *= 0.5
    return x, size


def _solve(matrices: Array, right: Array) -> Array:
    """Newton steps (N, 3), at most LONGEST_STEP_MM long; singular matrices are shifted."""
    tiny = np.abs(np.linalg.det(matrices)) < 1e-9
    matrices = np.where(tiny[:, None, None], matrices + 1e-3 * np.eye(3), matrices)
    step = np.linalg.solve(matrices, right[:, :, None])[:, :, 0]
    length = np.linalg.norm(step, axis=1, keepdims=True)
    return step * np.minimum(1.0, LONGEST_STEP_MM / np.maximum(length, 1e-300))
