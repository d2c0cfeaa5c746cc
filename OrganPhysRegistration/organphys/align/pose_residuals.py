"""Linearised residuals of a batch of poses: arrays per axis, (B, points), float32.

Kept per axis because (B, points, 3) costs three times the time.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array

Single = NDArray[np.float32]


@dataclass(frozen=True)
class Rows:
    """Linearised residuals: cost per pose (B,), weight, residual (B, P), and point, normal as three (B, P) each."""

    cost: Single
    weight: Single
    residual: Single
    point: tuple[Single, ...]
    normal: tuple[Single, ...]


def columns(points: Array) -> tuple[Single, ...]:
    x, y, z = np.ascontiguousarray(points.T, dtype=np.float32)
    return x, y, z


def homogeneous(points: Array) -> Single:
    return np.concatenate([points.T, np.ones((1, len(points)))]).astype(np.float32)


def transform(matrix: Array, shift: Array | None, columns: Single) -> tuple[Single, ...]:
    """matrix (B, 3, 3) @ columns (3 or 4, P) + shift (B, 3) as one product; three arrays (B, P)."""
    if shift is not None:
        matrix = np.concatenate([matrix, shift[..., None]], axis=2)
    rows = matrix.transpose(1, 0, 2).reshape(-1, matrix.shape[2]).astype(np.float32)
    x, y, z = (rows @ columns).reshape(3, len(matrix), -1)
    return x, y, z


def turn(matrix: Single, v: tuple[Single, ...]) -> tuple[Single, ...]:
    """matrix (B, 3, 3) times a different vector for every pose and point."""
    return tuple(dot((matrix[:, i, 0, None], matrix[:, i, 1, None], matrix[:, i, 2, None]), v) for i in range(3))


def dot(a: tuple[Single, ...], b: tuple[Single, ...]) -> Single:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def pick(mask: NDArray[np.bool_], a: tuple[Single, ...], b: tuple[Single, ...]) -> tuple[Single, ...]:
    x, y, z = (np.where(mask, p, q) for p, q in zip(a, b, strict=True))
    return x, y, z


def normal_equations(rows: Rows) -> tuple[Array, Array]:
    """J^T W J (B, 7, 7) and J^T W r (B, 7) for the change x' = exp(w) e^c x + v of the source frame."""
    (x, y, z), (a, b, c) = rows.point, rows.normal
    jacobian = np.stack([y * c - z * b, z * a - x * c, x * b - y * a, a, b, c, dot(rows.point, rows.normal)], axis=1)
    weighted = jacobian * rows.weight[:, None, :]
    hessian = weighted @ jacobian.transpose(0, 2, 1)
    gradient = (weighted @ rows.residual[..., None])[..., 0]
    return hessian.astype(np.float64), gradient.astype(np.float64)
