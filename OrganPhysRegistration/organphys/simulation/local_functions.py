"""Compactly supported kernels near a tool: extra displacement functions, so that a poke makes a dimple.

They are the kernels of a reproducing-kernel patch without the correction that reproduces linear fields, because the
handles of the body have those already. Wendland's C2 function (Adv. Comput. Math. 4, 1995):
f(r) = (1 - r)^4 (4 r + 1) for r < 1, else 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array


@dataclass(frozen=True)
class LocalFunctions:
    """Kernel centres (k, 3) and their radius, m, in the rest geometry; ``middle`` (3,): where they were asked for."""

    centres: Array
    radius: float
    middle: Array

    @property
    def reach(self) -> float:
        """All functions are zero farther than this from ``middle``, m."""
        return float(np.sqrt(((self.centres - self.middle) ** 2).sum(1)).max()) + self.radius

    def values(self, points: Array) -> Array:
        """Kernel values (N, k) at points (N, 3), m."""
        out = np.zeros((len(points), len(self.centres)))
        near = np.flatnonzero(((points - self.middle) ** 2).sum(1) < self.reach**2)
        r = self._offset_and_distance(points[near])[1]
        out[near] = (1 - r) ** 4 * (4 * r + 1)
        return out

    def values_and_gradients(self, points: Array) -> tuple[Array, Array]:
        """Values (N, k) and derivatives (3, N, k) per metre."""
        offset, r = self._offset_and_distance(points)
        slope = -20.0 * (1 - r) ** 3 / self.radius**2  # f'(r) / r per squared radius: no division by r is needed
        return (1 - r) ** 4 * (4 * r + 1), slope[None] * offset.transpose(2, 0, 1)

    def _offset_and_distance(self, points: Array) -> tuple[Array, Array]:
        """Offsets (N, k, 3), m, and distances (N, k) in radii, at most 1."""
        offset = points[:, None, :] - self.centres[None]
        return offset, np.minimum(np.sqrt((offset**2).sum(2)) / self.radius, 1.0)
