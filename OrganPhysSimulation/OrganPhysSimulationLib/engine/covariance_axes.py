"""Axes of many covariances at once, fast enough for every frame: Jacobi rotations gathered in quaternions.

Cyclic Jacobi eigenvalue iteration (Golub and Van Loan, Matrix Computations, 4th ed., 8.5); the rotation is kept as a
quaternion, as McAdams et al. (UW-Madison TR1690, 2011) do for 3 x 3 singular values.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Single = NDArray[np.float32]

SWEEPS = 3  # leaves less than 2e-5 of the largest variance off the diagonal
LEAST = 1e-12
CHUNK = 16384  # so many at a time stay in the processor's cache


def axes_of(covariances: Single, *, sweeps: int = SWEEPS) -> tuple[Single, Single]:
    """Standard deviations (K, 3) and unit quaternions (K, 4) w, x, y, z of covariances (K, 3, 3).

    R diag(s^2) R^T is the covariance, R being the quaternion's rotation.
    """
    deviations = np.empty((len(covariances), 3), dtype=np.float32)
    quaternions = np.empty((len(covariances), 4), dtype=np.float32)
    for start in range(0, len(covariances), CHUNK):
        part = slice(start, start + CHUNK)
        deviations[part], quaternions[part] = _axes_of(covariances[part], sweeps)
    return deviations, quaternions


def _axes_of(covariances: Single, sweeps: int) -> tuple[Single, Single]:
    c = np.ascontiguousarray(covariances.transpose(1, 2, 0), dtype=np.float32)
    c /= (size := np.maximum(np.trace(c), np.float32(1e-30)))
    diagonal, off = [c[0, 0], c[1, 1], c[2, 2]], [c[1, 2], c[0, 2], c[0, 1]]
    q = np.zeros((4, c.shape[2]), dtype=np.float32)
    q[0] = 1
    for _ in range(sweeps):
        for axis in range(3):
            _rotate(diagonal, off, q, axis)
    deviations = np.sqrt(np.maximum(np.stack(diagonal, axis=1), LEAST) * size[:, None])
    return deviations, (q / np.linalg.norm(q, axis=0)).T.astype(np.float32)


def _rotate(diagonal: list[Single], off: list[Single], q: Single, axis: int) -> None:
    """Turn about ``axis`` so that the element off the diagonal beside it vanishes."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    a, b, d = diagonal[i], diagonal[j], off[axis]
    turn = 0.5 * np.arctan2(np.where(a < b, -2 * d, 2 * d), np.abs(a - b))  # at most 45 degrees, else it may cycle
    cos, sin = np.cos(turn), np.sin(turn)
    diagonal[i] = cos * cos * a + 2 * sin * cos * d + sin * sin * b
    diagonal[j] = sin * sin * a - 2 * sin * cos * d + cos * cos * b
    off[axis] = np.zeros_like(d)
    off[j], off[i] = cos * off[j] + sin * off[i], cos * off[i] - sin * off[j]
    w, s = np.cos(0.5 * turn), np.sin(0.5 * turn)
    old = q.copy()
    q[0] = w * old[0] - s * old[1 + axis]
    q[1 + axis] = w * old[1 + axis] + s * old[0]
    q[1 + i] = w * old[1 + i] + s * old[1 + j]
    q[1 + j] = w * old[1 + j] - s * old[1 + i]


def turned(quaternions: Single, by: NDArray[np.floating]) -> Single:
    """The quaternions (K, 4) of the rotations ``by`` (4,) times those of ``quaternions``."""
    a, b, c, d = (np.float32(v) for v in by)
    w, x, y, z = quaternions.T
    out = [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x]
    return np.stack([*out, a * z + b * y - c * x + d * w], axis=1).astype(np.float32)
