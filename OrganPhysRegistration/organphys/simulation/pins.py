"""Pinned regions (ligaments, vessels): stiff springs that hold the tissue near a point where it rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array, InputError, as_positive, as_vector
from .simulation_basis import SimulationBasis


@dataclass(frozen=True)
class Pin:
    """All tissue within ``radius`` m of ``centre`` (3,), m in the scene; ``stiffness`` N/m of the whole region."""

    centre: tuple[float, float, float]
    radius: float
    stiffness: float = 2e4

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", tuple(as_vector(self.centre, "pin centre").tolist()))
        as_positive(self.radius, "pin radius")
        as_positive(self.stiffness, "pin stiffness")


def pinned_points(pins: tuple[Pin, ...], points: Array) -> tuple[Array, Array]:
    """Which of the rest positions (N, 3) m the pins hold (k, 3), and by springs of which stiffness (k,) N/m.

    Every pin shares its stiffness out evenly. InputError for a pin that holds nothing.
    """
    held, springs = [np.zeros((0, 3))], [np.zeros(0)]
    for pin in pins:
        distance = np.sqrt(((points - np.array(pin.centre)) ** 2).sum(1))
        inside = points[distance <= pin.radius]
        if not len(inside):
            raise InputError(
                f"pin at {[round(x, 4) for x in pin.centre]} m: no tissue within its {1000 * pin.radius:g} mm, the "
                f"nearest is {1000 * distance.min():.1f} mm away; move it or make it larger"
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
