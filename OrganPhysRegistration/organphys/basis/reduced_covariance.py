"""How uncertain the reduced coordinates and the scale are, and what that means for any mapped point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array, InputError


@dataclass(frozen=True)
class ReducedCovariance:
    """Covariance L L^T of q = (Z.ravel(), gamma) as its factor L (12H + 1, k), with y = R (X + Phi Z) / gamma + t.

    ``freedom``: degrees of freedom of the Student t that q follows (inf: Gaussian); L L^T is its covariance.
    """

    factor: Array
    freedom: float = np.inf

    def __post_init__(self) -> None:
        factor = np.array(self.factor, dtype=np.float64, order="C")
        if factor.ndim != 2 or factor.shape[0] % 3 != 1 or not np.isfinite(factor).all():
            raise InputError(f"covariance factor: expected finite numbers (12H + 1, k), got shape {factor.shape}")
        if not self.freedom > 2:
            raise InputError(f"degrees of freedom: expected more than 2, got {self.freedom}")
        object.__setattr__(self, "factor", factor)

    def at(self, phi: Array, mapped: Array) -> Array:
        """Covariance (N, 3, 3) of mapped points X + Phi Z (N, 3) with Phi (N, 4H), normalised lengths.

        A change of q moves them by Phi dZ - (X + Phi Z) dgamma at gamma = 1; rotation and translation are part of Z.
        """
        n = phi.shape[1]
        whole = self.factor @ self.factor.T
        if len(whole) != 3 * n + 1:
            raise InputError(f"covariance factor: {len(whole)} rows do not fit a basis of {n} columns")
        blocks, scale, edge = whole[:-1, :-1].reshape(n, 3, n, 3), whole[-1, -1], phi @ whole[:-1, -1].reshape(n, 3)
        out = np.empty((len(phi), 3, 3))
        for a in range(3):
            for b in range(a, 3):
                moved = np.einsum("ni,ni->n", phi @ blocks[:, a, :, b], phi)
                moved += scale * mapped[:, a] * mapped[:, b] - edge[:, a] * mapped[:, b] - edge[:, b] * mapped[:, a]
                out[:, a, b] = out[:, b, a] = moved
        return out
