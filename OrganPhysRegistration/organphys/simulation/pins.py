"""Pinned regions (ligaments, vessels): stiff springs that hold the tissue near a point where it rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array, InputError, as_points, as_positive, as_vector
from .simulation_basis import SimulationBasis


@dataclass(frozen=True)
class Pin:
    """All tissue within ``radius`` m of ``centre`` (3,), m in the scene; ``stiffness`` N/m of the whole region."""

    centre: Array
    radius: float
    stiffness: float = 2e4

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", as_vector(self.centre, "pin centre"))
        as_positive(self.radius, "pin radius")
        as_positive(self.stiffness, "pin stiffness")


def pin_matrix(basis: SimulationBasis, pins: tuple[Pin, ...], points: Array) -> Array:
    """Matrix P (n, n) in N/m: the springs store tr(Z^T P Z) / 2 and pull with P Z.

    ``points`` (N, 3) m: rest positions through the body and on its surface. InputError for a pin that holds none.
    """
    matrix = np.zeros((basis.size, basis.size))
    for pin in pins:
        held = points[((points - pin.centre) ** 2).sum(1) <= pin.radius**2]
        if not len(held):
            gap = float(np.sqrt(((points - pin.centre) ** 2).sum(1).min()))
            raise InputError(
                f"pin at {np.round(pin.centre, 4).tolist()} m: no tissue within its {1000 * pin.radius:g} mm, the "
                f"nearest is {1000 * gap:.1f} mm away; move it or make it larger"
            )
        matrix += spring_matrix(basis, held, np.full(len(held), pin.stiffness / len(held)))
    return matrix


def spring_matrix(basis: SimulationBasis, points: Array, stiffness: Array) -> Array:
    """The same matrix (n, n) for single springs of stiffness (N,) N/m at rest positions (N, 3), m."""
    phi = basis.phi(as_points(points, "spring points"))
    matrix: Array = phi.T @ (np.asarray(stiffness)[:, None] * phi)
    return matrix
