"""The basis baked at the vertices: an organ registered again and again is moved without evaluating its basis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..basis.reduced_basis import ReducedBasis
from ..ground.checks import Array
from ..ground.frames import Normalisation
from .in_chunks import in_chunks
from .registered_organ import RegisteredOrgan

CHUNK = 8192


@dataclass(frozen=True)
class BakedSurface:
    """phi (Nv, 4H) at the vertices (Nv, 3; CT mm) and its gradient (3, Nv, 4H), single precision: some 140 MB for
    70,000 vertices and 32 handles."""

    phi: Array
    gradient: NDArray[np.float32]
    length: float

    @classmethod
    def of(cls, basis: ReducedBasis, normalisation: Normalisation, vertices: Array) -> BakedSurface:
        """Bake ``basis`` at ``vertices``; costs as much as moving them once without it."""
        points = normalisation.apply(vertices)
        phi = np.empty((len(points), basis.size))
        gradient = np.empty((3, len(points), basis.size), dtype=np.float32)

        def evaluate(part: slice) -> None:
            phi[part], gradient[:, part] = basis.phi_and_gradient(points[part])

        in_chunks(len(points), CHUNK, evaluate)
        return cls(phi, gradient, normalisation.length)

    def motion(self, z: Array) -> tuple[Array, Array]:
        """Displacement (Nv, 3) in mm and its gradient (Nv, 3, 3), [a, m] = d u_a / d x_m, for Z (4H, 3)."""
        slopes = self.gradient @ z.astype(np.float32)
        return self.length * (self.phi @ z), slopes.transpose(1, 2, 0).astype(np.float64)

    def give(self, organ: RegisteredOrgan) -> None:
        """Let ``organ``, of the same vertices and basis, take the motion of its vertices from here."""
        vars(organ)["_surface_motion"] = self.motion(organ.z)  # where its cached property looks first
