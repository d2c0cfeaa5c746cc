"""Preconditioned L-BFGS for smooth energies that may be infinite outside their domain."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

from ..ground.checks import Array
from ..ground.solve_report import SolveReport, Stop
from .line_search import EnergyAndGradient, backtrack


def minimise(
    fun: EnergyAndGradient,
    x0: Array,
    *,
    precondition: Callable[[Array], Array],
    steps: int = 6,
    tolerance: float = 1e-10,
    memory: int = 8,
) -> tuple[Array, SolveReport]:
    """Minimum of ``fun`` from x0 (n,), where its energy must be finite; fun(x) -> energy, gradient (n,).

    ``precondition`` applies a symmetric positive definite approximation of the inverse Hessian, e.g. a Cholesky
    solve: it takes the place of the scaled identity in the two-loop recursion (Nocedal and Wright, "Numerical
    Optimization", 2nd ed., algorithm 7.4). Stops as CONVERGED when the predicted decrease is below ``tolerance``
    (unit of the energy); the report's residual is the last predicted decrease.
    """
    x = np.array(x0, dtype=np.float64)
    energy, gradient = fun(x)
    if not np.isfinite(energy):
        raise ValueError(f"x0: the energy there must be finite, got {energy}")
    pairs: deque[tuple[Array, Array]] = deque(maxlen=memory)
    evaluations, decrease = 1, float("nan")
    for iteration in range(steps):
        direction = -_two_loops(gradient, pairs, precondition)
        decrease = float(-(direction @ gradient))
        if decrease <= 0:  # the pairs have lost definiteness by rounding: begin again from the preconditioner
            pairs.clear()
            direction = -precondition(gradient)
            decrease = float(-(direction @ gradient))
        if decrease < tolerance:
            return x, SolveReport(Stop.CONVERGED, iteration, evaluations, decrease)
        accepted = backtrack(fun, x, energy, gradient, direction)
        evaluations += accepted.evaluations
        if not accepted.found:
            return x, SolveReport(Stop.STALLED, iteration, evaluations, decrease)
        move, change = accepted.x - x, accepted.gradient - gradient
        if move @ change > 1e-12 * np.sqrt((move @ move) * (change @ change)):
            pairs.append((move, change))
        x, energy, gradient = accepted.x, accepted.energy, accepted.gradient
    return x, SolveReport(Stop.STEP_LIMIT, steps, evaluations, decrease)


def _two_loops(gradient: Array, pairs: deque[tuple[Array, Array]], precondition: Callable[[Array], Array]) -> Array:
    """Approximate inverse Hessian times the gradient."""
    r, factors = gradient.copy(), []
    for s, y in reversed(pairs):
        factors.append((s @ r) / (s @ y))
        r -= factors[-1] * y
    r = np.array(precondition(r))
    for (s, y), factor in zip(pairs, reversed(factors), strict=True):
        r += (factor - (y @ r) / (s @ y)) * s
    return r
