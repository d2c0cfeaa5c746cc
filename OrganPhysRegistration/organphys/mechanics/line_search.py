"""Backtracking that never accepts a non-finite energy."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..ground.checks import Array

EnergyAndGradient = Callable[[Array], tuple[float, Array]]
SUFFICIENT = 1e-4  # Armijo's fraction of the predicted decrease
HALVINGS = 30


class Accepted(NamedTuple):
    """Point (n,), its energy and gradient (n,), and the evaluations spent; ``found`` False: nothing lower was met."""

    x: Array
    energy: float
    gradient: Array
    evaluations: int
    found: bool


def backtrack(fun: EnergyAndGradient, x: Array, energy: float, gradient: Array, direction: Array) -> Accepted:
    """First point of x + direction, x + direction/2, ... with a finite, sufficiently lower energy (Armijo 1966)."""
    slope = float(direction @ gradient)
    step = 1.0
    for k in range(HALVINGS):
        trial = x + step * direction
        e, g = fun(trial)
        if np.isfinite(e) and e <= energy + SUFFICIENT * step * slope and np.isfinite(g).all():
            return Accepted(trial, float(e), g, k + 1, True)
        step *= 0.5
    return Accepted(x, energy, gradient, HALVINGS, False)
