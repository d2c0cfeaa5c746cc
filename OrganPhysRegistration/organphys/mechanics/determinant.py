"""First and second derivative of the determinant of 3 x 3 matrices, written out."""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array

LEVI_CIVITA = np.zeros((3, 3, 3))
LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0
LEVI_CIVITA.setflags(write=False)

# d cof[a, m] / d F[b, n] = sum_kl eps[a, b, k] eps[m, n, l] F[k, l], as one (9, 81) matrix acting on F.ravel()
_SECOND = np.ascontiguousarray(np.einsum("abk,mnl->klambn", LEVI_CIVITA, LEVI_CIVITA).reshape(9, 81))
_SECOND.setflags(write=False)


def cofactor(components: Array) -> Array:
    """Cofactor matrix d det F / d F, shape (3, 3, Q), of F (3, 3, Q): its rows are cross products of F's rows."""
    out = np.empty_like(components)
    for a in range(3):
        f, g = components[(a + 1) % 3], components[(a + 2) % 3]
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            np.multiply(f[n], g[o], out=out[a, m])
            out[a, m] -= f[o] * g[n]
    return out


def cofactor_derivative(gradient: Array) -> Array:
    """Second derivative (Q, 9, 9) of det F at F (Q, 3, 3), entries ordered as 3 a + m."""
    return (np.reshape(gradient, (-1, 9)) @ _SECOND).reshape(-1, 9, 9)
