"""A prior that holds the coordinates Z near those of the previous time step, where the data says little."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..basis.reduced_basis import ReducedBasis
from ..ground.checks import Array
from .joint_scale import Quadratic


@dataclass(frozen=True)
class TemporalPrior:
    """Penalty (Z - Z0)^T K (Z - Z0) of the flattened coordinates, with Z0 ``z`` (4H, 3) and K ``stiffness`` (12H, 12H).

    In the whitened basis |Z - Z0|^2 is the mean square displacement of the organ's volume since Z0, in squared
    normalised lengths, as the data terms are.
    """

    z: Array
    stiffness: Array

    @classmethod
    def of(cls, basis: ReducedBasis, z: Array, strength: float) -> TemporalPrior:
        """Damping of ``strength`` (no unit: 1 weighs a volume that moves by d since ``z`` as much as data that is off
        by d) in a whitened basis. Motion as a rigid body is not held back: it is well seen, and damping it would make
        the organ lag behind the splat.
        """
        rigid = np.linalg.qr(_rigid_motions(basis, z))[0]
        return cls(z, strength * (np.eye(z.size) - rigid @ rigid.T))

    def added_to(self, data: Quadratic) -> Quadratic:
        """The data term over q = (Z.ravel(), gamma) plus this penalty."""
        hessian, linear = data.hessian.copy(), data.linear.copy()
        hessian[:-1, :-1] += 2 * self.stiffness
        linear[:-1] -= 2 * self.stiffness @ self.z.ravel()
        return replace(data, hessian=hessian, linear=linear)


def _rigid_motions(basis: ReducedBasis, z: Array) -> Array:
    """Columns (12H, 6): infinitesimal rotations and translations of the organ deformed by ``z``."""
    columns = []
    for axis in np.eye(3):
        spin = np.cross(np.eye(3), axis)  # skew matrix, spin @ x = axis x x up to sign, which the span does not feel
        columns.append((basis.similarity_coordinates(spin, np.zeros(3)) + z @ spin.T).ravel())
        columns.append(basis.similarity_coordinates(np.zeros((3, 3)), axis).ravel())
    return np.stack(columns, axis=1)
