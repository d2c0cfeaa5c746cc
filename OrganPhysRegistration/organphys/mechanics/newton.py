"""Projected Newton: the reference solver, for comparison with the faster ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg

from ..ground.checks import Array
from ..ground.solve_report import SolveReport, Stop
from .line_search import EnergyAndGradient, backtrack


def newton(
    fun: EnergyAndGradient,
    hessian: Callable[[Array], Array],
    x0: Array,
    *,
    steps: int = 30,
    tolerance: float = 1e-12,
) -> tuple[Array, SolveReport]:
    """Minimum of ``fun`` from x0 (n,); ``hessian(x)`` (n, n) should be positive semi-definite (projected).

    A shift is added until the Cholesky factor exists. CONVERGED: the predicted decrease, half the Newton decrement
    squared, is below ``tolerance`` (unit of the energy); it is the report's residual.
    """
    x = np.array(x0, dtype=np.float64)
    energy, gradient = fun(x)
    if not np.isfinite(energy):
        raise ValueError(f"x0: the energy there must be finite, got {energy}")
    evaluations, decrease = 1, float("nan")
    for iteration in range(steps):
        direction = -_solve_definite(hessian(x), gradient)
        decrease = float(-0.5 * (direction @ gradient))
        if decrease < tolerance:
            return x, SolveReport(Stop.CONVERGED, iteration, evaluations, decrease)
        accepted = backtrack(fun, x, energy, gradient, direction)
        evaluations += accepted.evaluations
        if not accepted.found:
            return x, SolveReport(Stop.STALLED, iteration, evaluations, decrease)
        x, energy, gradient = accepted.x, accepted.energy, accepted.gradient
    return x, SolveReport(Stop.STEP_LIMIT, steps, evaluations, decrease)


def _solve_definite(matrix: Array, right: Array) -> Array:
    """(matrix + shift I)^-1 right with the smallest tried shift that makes the matrix positive definite."""
    size = np.trace(np.abs(matrix)) / len(matrix) + np.finfo(float).tiny
    for shift in (0.0, 1e-10, 1e-7, 1e-4, 1e-1, 1e2):
        try:
            factor = scipy.linalg.cho_factor(matrix + shift * size * np.eye(len(matrix)), lower=True)
        except np.linalg.LinAlgError:
            continue
        return np.asarray(scipy.linalg.cho_solve(factor, right), dtype=np.float64)
    raise ValueError("hessian: not positive definite even with a large shift; is it symmetric and projected?")
