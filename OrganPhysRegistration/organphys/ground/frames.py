"""Coordinate frames, similarity transforms and length units.

CT side: RAS millimetres. Splat side ("scene"): the raw coordinates of the PLY, OpenCV camera
(x right, y down, z forward). Transforms carry both frames in the name: ``T_scene_ct`` maps CT to scene.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .checks import Array, InputError, as_positive

MM_PER_UNIT = {"m": 1000.0, "cm": 10.0, "mm": 1.0}


def ras_from_lps(points: Array) -> Array:
    """Points (N, 3) or a direction (3,) from LPS to RAS, in any unit; the map is its own inverse."""
    return np.asarray(points, dtype=np.float64) * np.array([-1.0, -1.0, 1.0])


def rotation_between(source: Array, target: Array) -> Array:
    """Smallest rotation (3, 3) that turns direction ``source`` (3,) onto ``target`` (3,).

    Half a turn about ``source``, then half a turn about the bisector: orthogonal to rounding also for nearly opposite
    directions, where Rodrigues' formula divides by 1 + cos.
    """
    a = source / np.linalg.norm(source)
    bisector = a + target / np.linalg.norm(target)
    length = np.linalg.norm(bisector)
    if length < 1e-8:  # opposite: any perpendicular direction bisects them
        bisector = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        length = np.linalg.norm(bisector)
    bisector = bisector / length
    return (2 * np.outer(bisector, bisector) - np.eye(3)) @ (2 * np.outer(a, a) - np.eye(3))


def tangent_axes(normals: Array) -> tuple[Array, Array]:
    """Two unit vectors (N, 3) each, perpendicular to unit ``normals`` (N, 3) and to each other."""
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def rotation_about(axis: Array, angle: float) -> Array:
    """Rotation (3, 3) by ``angle`` (radians) about ``axis`` (3,) through the origin."""
    k = cross_matrix(np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis))
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def rotation_angle(a: Array, b: Array) -> Array:
    """Angle (...) in radians between rotations (..., 3, 3), by |A - B| = 2 sqrt(2) sin(angle / 2): exact when small."""
    apart = np.sqrt(np.square(a - b).sum((-1, -2)) / 8)
    angle: Array = 2 * np.arcsin(np.minimum(apart, 1.0))
    return angle


def cross_matrix(v: Array) -> Array:
    """Matrix (3, 3) of the cross product: cross_matrix(v) @ w = v x w."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]], dtype=np.float64)


@dataclass(frozen=True)
class Similarity:
    """y = scale * rotation @ x + translation, with a proper rotation and scale > 0."""

    scale: float
    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "scale", as_positive(self.scale, "scale"))
        object.__setattr__(self, "rotation", np.array(self.rotation, dtype=np.float64).reshape(3, 3))
        object.__setattr__(self, "translation", np.array(self.translation, dtype=np.float64).reshape(3))

    @classmethod
    def identity(cls) -> Similarity:
        return cls(1.0, np.eye(3), np.zeros(3))

    @classmethod
    def of_matrix(cls, matrix: ArrayLike) -> Similarity:
        """From a homogeneous (4, 4) matrix, rounding in its rotation removed; InputError if it is no similarity."""
        m = np.asarray(matrix, dtype=np.float64)
        if m.shape != (4, 4) or not np.isfinite(m).all():
            raise InputError(f"pose: expected a finite matrix (4, 4), got shape {m.shape}")
        determinant = float(np.linalg.det(m[:3, :3]))
        scale = np.cbrt(max(determinant, 0.0))
        u, stretch, vt = np.linalg.svd(m[:3, :3])
        if not scale > 0 or np.abs(stretch / scale - 1).max() > 1e-3 or not np.allclose(m[3], [0, 0, 0, 1]):
            raise InputError(
                "pose: expected rotation, shift and one scale for all axes; reset the transform and redo it"
            )
        return cls(float(scale), u @ vt, m[:3, 3])

    @property
    def key(self) -> bytes:
        """Its numbers, exactly: what a table of results by pose goes by."""
        numbers: bytes = self.matrix.tobytes()
        return numbers

    @property
    def matrix(self) -> Array:
        """Homogeneous (4, 4) matrix."""
        m = np.eye(4)
        m[:3, :3] = self.scale * self.rotation
        m[:3, 3] = self.translation
        return m

    def apply(self, points: Array) -> Array:
        """Points (N, 3) or (3,) mapped; the result is in the target frame's unit."""
        return self.scale * (np.asarray(points) @ self.rotation.T) + self.translation

    def turn(self, directions: Array) -> Array:
        """Directions (N, 3) or (3,) turned, their length kept."""
        return np.asarray(directions) @ self.rotation.T

    def inverse(self) -> Similarity:
        rotation = self.rotation.T
        return Similarity(1 / self.scale, rotation, -(rotation @ self.translation) / self.scale)

    def __matmul__(self, other: Similarity) -> Similarity:
        """T_a_b @ T_b_c = T_a_c."""
        return Similarity(self.scale * other.scale, self.rotation @ other.rotation, self.apply(other.translation))


@dataclass(frozen=True)
class Normalisation:
    """Unit-free coordinates X = (x - centre) / length of one point set; ``centre`` (3,) and ``length`` in mm."""

    centre: Array
    length: float

    def apply(self, points: Array) -> Array:
        return (np.asarray(points, dtype=np.float64) - self.centre) / self.length

    def undo(self, points: Array) -> Array:
        return np.asarray(points) * self.length + self.centre

    @property
    def T_ct_normalised(self) -> Similarity:
        return Similarity(self.length, np.eye(3), self.centre)


def fit_similarity(source: Array, target: Array, weights: Array | None = None, *, scale: bool = True) -> Similarity:
    """Weighted least-squares similarity (or rigid motion) T_target_source between paired points (N, 3).

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
    PAMI 1991; the rotation is proper (det +1) even for mirrored data.
    """
    w = np.full(len(source), 1 / len(source)) if weights is None else weights / weights.sum()
    mean_source, mean_target = w @ source, w @ target
    a, b = source - mean_source, target - mean_target
    u, singular, vt = np.linalg.svd((b * w[:, None]).T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * signs) @ vt
    factor = float((singular * signs).sum() / (w @ (a * a).sum(1))) if scale else 1.0
    return Similarity(factor, rotation, mean_target - factor * rotation @ mean_source)
