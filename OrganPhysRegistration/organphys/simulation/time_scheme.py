"""Implicit time schemes as one minimisation: backward Euler and BDF2.

Both give z = old + h v and v = old_v + h a(z), so the new z minimises m |z - predicted|^2 / (2 h^2) + potential(z)
with predicted = old + h old_v. Backward Euler: old = z_n, old_v = v_n, h = dt. BDF2 (Hairer and Wanner, "Solving
Ordinary Differential Equations II", section III.1): (4 z_n - z_{n-1}) / 3 and likewise for v, h = 2 dt / 3.
"""

from __future__ import annotations

from typing import NamedTuple

from ..ground.checks import Array
from .state import BodyState


class SchemeStep(NamedTuple):
    """``old`` (n, 3) and ``old_velocity`` (n, 3) combine the past states; ``h`` in s; ``lagged`` (n, 3): coordinates
    for what a step takes from the past (viscosity), to the order of the scheme."""

    old: Array
    old_velocity: Array
    h: float
    lagged: Array

    @property
    def predicted(self) -> Array:
        """Coordinates (n, 3) that the body would have without forces."""
        return self.old + self.h * self.old_velocity


def scheme_step(scheme: str, state: BodyState, dt: float) -> SchemeStep:
    """One step of "backward_euler" or "bdf2" from ``state``; BDF2 without a past step of the same dt takes the first.

    A single backward Euler step leaves the second order of the whole run unharmed.
    """
    if scheme == "bdf2" and abs(state.dt_before - dt) <= 1e-9 * dt:
        old = (4 * state.z - state.z_before) / 3
        old_velocity = (4 * state.velocity - state.velocity_before) / 3
        return SchemeStep(old, old_velocity, 2 * dt / 3, 2 * state.z - state.z_before)
    return SchemeStep(state.z, state.velocity, dt, state.z)
