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
    """Kernel centres (k, 3) and their radius, m, in the rest geometry."""

    centres: Array
    radius: float

    def values(self, points: Array) -> Array:
        """Kernel values (N, k) at points (N, 3), m."""
        r = np.minimum(self._distance(points)[1] / self.radius, 1.0)
        return (1 - r) ** 4 * (4 * r + 1)

    def values_and_gradients(self, points: Array) -> tuple[Array, Array]:
        """Values (N, k) and derivatives (3, N, k) per metre."""
        offset, distance = self._distance(points)
        r = np.minimum(distance / self.radius, 1.0)
        slope = -20.0 * (1 - r) ** 3 / self.radius**2  # f'(r) / r per squared radius: no division by r is needed
        return (1 - r) ** 4 * (4 * r + 1), slope[None] * offset.transpose(2, 0, 1)

    def _distance(self, points: Array) -> tuple[Array, Array]:
        offset = points[:, None, :] - self.centres[None]
        return offset, np.sqrt((offset**2).sum(2))
