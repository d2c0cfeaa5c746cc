"""Options of a simulation, checked when they are made."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..ground.checks import Array, InputError, as_positive, as_vector, one_of

STANDARD_GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True)
class SimulationOptions:
    """How a scene moves.

    gravity (3,) m/s^2 along the scene's axes (see ``gravity_along``). A registered organ already hangs as gravity held
    it: ``registered_gravity`` (3,) m/s^2 is what the rest shape carries without moving, and only the difference moves
    the tissue. Give it the same value as gravity for an organ seen in place: it stays as registered until tools move
    it or gravity turns. The forces that balance it stay with the tissue, so an organ whose pins are cut does not fall
    by it; its stiffness is that of the unloaded tissue. The default, zero, takes the shape as free of load: gravity
    then bends it once more. scheme "backward_euler" (damps on its own) or
    "bdf2" (second order). Damping of Rayleigh's kind: mass_damping in 1/s, stiffness_damping in s. tolerance: residual
    force of a step in parts of the largest force of its balance; the rms error of the step's positions is then below
    dt^2 times the residual over the mass (``BodyReport.error_m``) where the energy is convex. newton_steps and effort
    (Hessian products of a body without local functions, with those of one that has some, evaluations, preconditioners
    and the search for contacts counted as what they cost beside one) bound the time of a step, all its sub-steps
    together; one that ends there is less exact, which its report says (``Stop.STEP_LIMIT``), and sound all the same.
    Counts instead of a clock keep runs deterministic.
    contact_gap m: distance at which tools begin to push; contact_pressure Pa: scale of that push; friction:
    Coulomb coefficient; slip_speed m/s: below it friction sticks softly.
    """

    gravity: Array = field(default_factory=lambda: np.zeros(3))
    scheme: str = "backward_euler"
    mass_damping: float = 0.5
    stiffness_damping: float = 0.005
    tolerance: float = 1e-3
    newton_steps: int = 15
    effort: int = 150
    contact_gap: float = 1e-3
    contact_pressure: float = 1e5
    friction: float = 0.2
    slip_speed: float = 2e-3
    registered_gravity: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        for name in ("gravity", "registered_gravity"):
            object.__setattr__(self, name, as_vector(getattr(self, name), name.replace("_", " ")))
        one_of(self.scheme, "scheme", ("backward_euler", "bdf2"))
        for name in ("tolerance", "contact_gap", "contact_pressure", "slip_speed"):
            as_positive(getattr(self, name), name)
        for name in ("mass_damping", "stiffness_damping", "friction"):
            value = getattr(self, name)
            if not np.isfinite(value) or value < 0:
                raise InputError(f"{name}: expected a finite number of at least 0, got {value}")
        for name in ("newton_steps", "effort"):
            if getattr(self, name) < 1:
                raise InputError(f"{name}: expected at least 1, got {getattr(self, name)}")

    @property
    def felt_gravity(self) -> Array:
        """What of gravity moves the tissue (3,), m/s^2."""
        felt: Array = self.gravity - self.registered_gravity
        return felt


def gravity_along(direction: Array, strength: float = STANDARD_GRAVITY) -> Array:
    """Gravity (3,) in m/s^2 along a direction (3,) of any length."""
    down = as_vector(direction, "gravity direction")
    length = float(np.linalg.norm(down))
    if length == 0:
        raise InputError("gravity direction: it must not be the zero vector")
    return down * (strength / length)
