"""Pinned regions (ligaments, vessels): stiff springs that hold the tissue near a point where it rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array, InputError, as_positive, as_vector
from .simulation_basis import SimulationBasis

STIFFNESS = 2e4  # N/m of a region


@dataclass(frozen=True)
class Pin:
    """All tissue within ``radius`` m of ``centre`` (3,), m in the scene; ``stiffness`` N/m of the whole region."""

    centre: tuple[float, float, float]
    radius: float
    stiffness: float = STIFFNESS

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", tuple(as_vector(self.centre, "pin centre").tolist()))
        as_positive(self.radius, "pin radius")
        as_positive(self.stiffness, "pin stiffness")

    @property
    def size(self) -> str:
        """How large it is, in mm."""
        return f"{1000 * self.radius:g}"

    def distances(self, points: Array) -> Array:
        """Distances (N,) m from the region of rest positions (N, 3) m; 0 within it."""
        away: Array = np.sqrt(((points - np.array(self.centre)) ** 2).sum(1)) - self.radius
        return np.maximum(away, 0.0)


@dataclass(frozen=True)
class BoxPin:
    """All tissue in a box: ``centre`` (3,) m in the scene, ``sides`` (3,) m along the rows of ``axes`` (3, 3), which
    are at right angles and of unit length; ``stiffness`` N/m of the whole region."""

    centre: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], ...]
    sides: tuple[float, float, float]
    stiffness: float = STIFFNESS

    def __post_init__(self) -> None:
        for name in ("centre", "sides"):
            object.__setattr__(self, name, tuple(as_vector(getattr(self, name), f"pin box {name}").tolist()))
        turn = np.array(self.axes, dtype=np.float64)
        if turn.shape != (3, 3) or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-6):
            raise InputError("pin box axes: expected three unit vectors at right angles")
        object.__setattr__(self, "axes", tuple(tuple(row) for row in turn.tolist()))
        for side in self.sides:
            as_positive(side, "pin box side")
        as_positive(self.stiffness, "pin stiffness")

    @property
    def size(self) -> str:
        """How large it is, in mm."""
        return " x ".join(f"{1000 * side:.3g}" for side in self.sides)

    def distances(self, points: Array) -> Array:
        """Distances (N,) m from the box of rest positions (N, 3) m; 0 within it."""
        local = np.abs((points - np.array(self.centre)) @ np.array(self.axes).T) - 0.5 * np.array(self.sides)
        away: Array = np.sqrt((np.maximum(local, 0.0) ** 2).sum(1))
        return away


AnyPin = Pin | BoxPin


def pinned_points(pins: tuple[AnyPin, ...], points: Array) -> tuple[Array, Array]:
    """Which of the rest positions (N, 3) m the pins hold (k, 3), and by springs of which stiffness (k,) N/m.

    Every pin shares its stiffness out evenly. InputError for a pin that holds nothing.
    """
    held, springs = [np.zeros((0, 3))], [np.zeros(0)]
    for pin in pins:
        away = pin.distances(points)
        inside = points[away == 0]
        if not len(inside):
            raise InputError(
                f"pin at {[round(x, 4) for x in pin.centre]} m: no tissue within its {pin.size} mm, the "
                f"nearest is {1000 * away.min():.1f} mm away; move it or make it larger"
            )
        held.append(inside)
        springs.append(np.full(len(inside), pin.stiffness / len(inside)))
    return np.concatenate(held), np.concatenate(springs)


def spring_matrix(basis: SimulationBasis, points: Array, stiffness: Array) -> Array:
    """Matrix P (n, n) in N/m of springs (k,) N/m at rest positions (k, 3) m.

    They store tr(Z^T P Z) / 2 and pull with P Z.
    """
    phi = basis.phi(points)
    matrix: Array = phi.T @ (stiffness[:, None] * phi)
    return matrix
