"""Correspondences of the elastic stage: which organ sample should be where, how surely, and in which direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.frames import Similarity


@dataclass(frozen=True)
class Matches:
    """K matches: organ sample ``rows`` (K,), ``targets`` (K, 3) in the CT-normalised frame of the starting pose,
    ``weights`` (K,), unit ``normals`` (K, 3) and ``plane`` (K,), the share of the metric along the normal.

    Cost: sum_k w |x_k - gamma a_k|^2 in the metric (1 - plane) I + plane n n^T.
    """

    rows: NDArray[np.int64]
    targets: Array
    weights: Array
    normals: Array
    plane: Array

    @classmethod
    def join(cls, parts: list[Matches]) -> Matches:
        return cls(*(np.concatenate([getattr(p, name) for p in parts]) for name in cls.__dataclass_fields__))

    def metric(self) -> Array:
        """Weighted metric (K, 3, 3) of every match."""
        along = (self.weights * self.plane)[:, None, None] * self.normals[:, :, None] * self.normals[:, None, :]
        return along + (self.weights * (1 - self.plane))[:, None, None] * np.eye(3)


@dataclass(frozen=True)
class Deformed:
    """State of the organ in one outer step, CT-normalised frame, and how it stands before the camera.

    points, normals (S, 3); ``gamma`` is the joint scale unknown: a scene point u pairs with gamma R^T (u - t) / s of
    the starting pose ``start`` = T_camera_normalised, so the pose in force has scale s / gamma.
    """

    points: Array
    normals: Array
    gamma: float
    start: Similarity

    @property
    def pose(self) -> Similarity:
        """T_camera_normalised in force."""
        return Similarity(self.start.scale / self.gamma, self.start.rotation, self.start.translation)

    def target_frame(self, points_camera: Array) -> Array:
        """Camera-frame points in the CT-normalised frame of the starting pose (before gamma)."""
        return self.start.inverse().apply(points_camera)


def geman_mcclure(squared: Array, tau: float) -> Array:
    """Weights 1 / (1 + e / tau^2)^2 of the robust cost e / (1 + e / tau^2)."""
    weight: Array = (1 + squared / tau**2) ** -2
    return weight
