"""A batch of candidate similarities, for searches that treat thousands at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.frames import Similarity


@dataclass(frozen=True)
class Poses:
    """B similarities y = scale R x + translation: scale (B,), rotation (B, 3, 3), translation (B, 3)."""

    scale: Array
    rotation: Array
    translation: Array

    def __len__(self) -> int:
        return len(self.scale)

    def __getitem__(self, index: slice | NDArray[np.integer] | NDArray[np.bool_]) -> Poses:
        return Poses(self.scale[index], self.rotation[index], self.translation[index])

    def at(self, index: int) -> Similarity:
        """One of them."""
        return Similarity(float(self.scale[index]), self.rotation[index], self.translation[index])

    @classmethod
    def join(cls, parts: list[Poses]) -> Poses:
        return cls(
            np.concatenate([p.scale for p in parts]),
            np.concatenate([p.rotation for p in parts]),
            np.concatenate([p.translation for p in parts]),
        )

    @classmethod
    def of(cls, similarities: list[Similarity]) -> Poses:
        return cls(
            np.array([s.scale for s in similarities]),
            np.array([s.rotation for s in similarities]),
            np.array([s.translation for s in similarities]),
        )

    def source_twist(self, step: Array) -> Poses:
        """Poses after a change of what they pull back: if these send x to y, the new ones send e^c exp(w) x + v to y.

        step (B, 7): rotation vector w (rad), shift v, log scale c.
        """
        rotation = self.rotation @ exp_rotation(step[:, :3]).transpose(0, 2, 1)
        scale = self.scale / np.exp(step[:, 6])
        translation = self.translation - scale[:, None] * np.einsum("bij,bj->bi", rotation, step[:, 3:6])
        return Poses(scale, rotation, translation)

    def distinct(self, score: Array, *, most: int, angle_deg: float, log_scale: float = 0.1) -> NDArray[np.int64]:
        """Indices of at most ``most`` poses, best (lowest score) first, each apart from the better ones.

        Two poses are the same when their rotations differ by less than ``angle_deg`` and their log scales by less
        than ``log_scale``.
        """
        kept: list[int] = []
        flat, log_scales = self.rotation.reshape(len(self), 9), np.log(self.scale)
        free = np.ones(len(self), dtype=bool)
        for i in np.argsort(score, kind="stable"):
            if not free[i]:
                continue
            kept.append(int(i))
            if len(kept) == most:
                break
            cosine = (flat @ flat[i] - 1) / 2  # trace(R_i^T R_j) = 1 + 2 cos(angle)
            free &= (cosine < np.cos(np.radians(angle_deg))) | (np.abs(log_scales - log_scales[i]) > log_scale)
        return np.array(kept, dtype=np.int64)


def exp_rotation(vectors: Array) -> Array:
    """Rotations (B, 3, 3) of rotation vectors (B, 3) in radians (Rodrigues)."""
    angle = np.maximum(np.linalg.norm(vectors, axis=1), 1e-9)[:, None, None]
    k = np.zeros((len(vectors), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -vectors[:, 2], vectors[:, 1], -vectors[:, 0]
    k -= k.transpose(0, 2, 1)
    return np.eye(3) + np.sin(angle) / angle * k + (1 - np.cos(angle)) / angle**2 * (k @ k)
