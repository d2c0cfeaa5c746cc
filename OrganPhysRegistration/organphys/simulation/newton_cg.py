"""Newton's method with conjugate gradients: the minimum of the incremental potential, to a relative residual.

Each linear system is solved with the true Hessian by preconditioned conjugate gradients, cut off where the curvature
is not positive (Nocedal and Wright, "Numerical Optimization", 2nd ed., algorithm 7.1). The line search accepts only
finite energies, so never det F <= 0, and only states that tissue can reach without going through a tool.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from ..ground.checks import Array
from ..ground.solve_report import SolveReport, Stop
from .options import SimulationOptions

SUFFICIENT = 1e-4  # Armijo's fraction of the predicted decrease
HALVINGS, FEWEST = 12, 4  # tries of a line search at most, and where the effort is spent
CG_STEPS = 60
EVALUATION, FACTOR = 3, 4  # an evaluation, a preconditioner with its tangent cost as much as so many Hessian products
FORCING = 0.05  # linear systems are solved to this part of the residual, or to the tolerance where that is more
LEAST_FORCE = 1e-3  # m/s^2: forces are compared with at least this times the mass
ROUNDING = 1e-13


class Point(Protocol):
    """Energy in J, gradient (n, 3) in N at coordinates z (n, 3); ``largest`` N: the largest force in the balance."""

    @property
    def z(self) -> Array: ...
    @property
    def energy(self) -> float: ...
    @property
    def gradient(self) -> Array: ...
    @property
    def largest(self) -> float: ...


class Potential(Protocol):
    """What is minimised: ``IncrementalPotential`` of one body or ``JointPotential`` of several."""

    @property
    def options(self) -> SimulationOptions: ...
    @property
    def mass(self) -> float: ...
    @property
    def rounding(self) -> float: ...
    def evaluate(self, z: Array) -> Any: ...
    def tangent(self, at: Any) -> Any: ...
    def firmer(self, at: Any, change: Array) -> Any | None: ...
    def product(self, tangent: Any, change: Array) -> Array: ...
    def admissible(self, z: Array) -> bool: ...


class Preconditioner(Protocol):
    """An approximate inverse Hessian."""

    def solve(self, residual: Array) -> Array: ...


class Factors(Protocol):
    """Makes preconditioners: ``FactorCache`` or ``JointFactors``."""

    def factor(self, potential: Any, at: Any, reference: Array) -> Preconditioner: ...


class Solved(NamedTuple):
    """Where Newton stopped, why, how many conjugate gradient steps it took, and what all of it cost, in these."""

    at: Any
    report: SolveReport
    cg_steps: int
    effort: int


def minimise(
    potential: Potential,
    starts: tuple[Array, ...],
    reference: Array,
    cache: Factors,
    *,
    effort: int | None = None,
) -> Solved:
    """Minimum from the first of ``starts`` (n, 3) that is admissible; the last one must be.

    ``reference`` (n, 3): where the preconditioner takes its stiffness; ``effort``: about so many Hessian products, or
    what costs as much, at most, those of the options if not given.
    The report's residual is the norm of the gradient over the largest force. With ``Stop.STALLED`` or STEP_LIMIT the
    state is still finite, just not as exact as asked.
    """
    at: Point = _first_admissible(potential, starts)
    evaluations, cg_steps, factors, spent = 1, 0, 0, EVALUATION
    effort = potential.options.effort if effort is None else effort
    stop = Stop.STEP_LIMIT
    for iteration in range(potential.options.newton_steps + 1):
        largest = max(at.largest, LEAST_FORCE * potential.mass)
        norm = float(np.linalg.norm(at.gradient))
        goal = potential.options.tolerance * largest
        if norm <= goal:
            stop = Stop.CONVERGED
            break
        left = effort - spent - FACTOR - EVALUATION
        if iteration == potential.options.newton_steps or left <= 0:
            break
        direction, used = _direction(potential, at, cache, reference, max(FORCING * norm, 0.3 * goal), left)
        cg_steps += used.products
        left -= used.products + FACTOR * (used.factors - 1)
        trial, tried = _line_search(potential, at, direction, min(HALVINGS, max(left // EVALUATION, FEWEST)))
        evaluations, factors = evaluations + tried, factors + used.factors
        spent = EVALUATION * evaluations + cg_steps + FACTOR * factors
        if trial is None:
            stop = Stop.STALLED
            break
        at = trial
    report = SolveReport(stop, iteration, evaluations, norm / largest)
    return Solved(at, report, cg_steps, spent)


def _first_admissible(potential: Potential, starts: tuple[Array, ...]) -> Point:
    for z in starts[:-1]:
        if potential.admissible(z):
            at = potential.evaluate(z)
            if np.isfinite(at.energy):
                return at
    at = potential.evaluate(starts[-1])
    if not np.isfinite(at.energy):
        raise ValueError("state: the body is turned inside out (det F <= 0) before the step")
    return at


class Used(NamedTuple):
    """Hessian products and preconditioners that a direction took."""

    products: int
    factors: int


def _direction(
    potential: Potential, at: Point, cache: Factors, reference: Array, goal: float, left: int
) -> tuple[Array, Used]:
    """Newton direction (n, 3) with a residual of at most ``goal`` N, once more where friction would turn round."""
    most = min(CG_STEPS, left)
    direction, used = _solved(potential, at, cache.factor(potential, at, reference), goal, most)
    firmer = potential.firmer(at, direction) if left - used > FACTOR else None
    if firmer is None:
        return direction, Used(used, 1)
    most = min(CG_STEPS, left - used - FACTOR)
    direction, more = _solved(potential, firmer, cache.factor(potential, firmer, reference), goal, most)
    return direction, Used(used + more, 2)


def _solved(potential: Potential, at: Point, factor: Preconditioner, goal: float, most: int) -> tuple[Array, int]:
    """Newton direction (n, 3) with a residual of at most ``goal`` N, and its Hessian products, <= ``most``."""
    tangent = potential.tangent(at)
    x, r = np.zeros_like(at.gradient), -at.gradient
    y = factor.solve(r)
    p, ry = y, float((r * y).sum())
    for k in range(most):
        q = potential.product(tangent, p)
        curvature = float((p * q).sum())
        if curvature <= 0:
            return (y if k == 0 else x), k + 1
        step = ry / curvature
        x = x + step * p
        r = r - step * q
        if float(np.linalg.norm(r)) <= goal:
            return x, k + 1
        y = factor.solve(r)
        ry, before = float((r * y).sum()), ry
        p = y + (ry / before) * p
    return x, most


def _line_search(potential: Potential, at: Point, direction: Array, tries: int) -> tuple[Point | None, int]:
    """First of the full step, half of it, ... that is admissible, finite and lower; None if ``tries`` found none."""
    slope, step = float((at.gradient * direction).sum()), 1.0
    for k in range(tries):
        z = at.z + step * direction
        if potential.admissible(z):
            trial = potential.evaluate(z)
            bound = at.energy + SUFFICIENT * step * slope + ROUNDING * abs(at.energy) + potential.rounding
            if trial.energy <= bound and np.isfinite(trial.gradient).all():
                return trial, k + 1
        step *= 0.5
    return None, tries
