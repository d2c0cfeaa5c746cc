"""Landmarks as a prior: the clicked place of the organ should face the camera and lie on the seen surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..points.surface_samples import SurfaceSamples
from .poses import Poses
from .splat_view import SplatView

ON_SURFACE = 0.15  # a landmark this near (normalised length) to the seen surface counts as met
STRONGEST = 0.15  # a landmark may tip the choice between near-equal poses, never overrule the data


@dataclass(frozen=True)
class LandmarkPrior:
    """Landmarks on the organ surface, normalised CT frame: index (L,) of the nearest surface sample of each; within
    ``radius`` (normalised length) of the seen surface one counts as met."""

    positions: Array
    normals: Array
    sample_index: NDArray[np.int64]
    radius: float = ON_SURFACE

    @classmethod
    def of(cls, positions_mm: Array, samples: SurfaceSamples, *, radius_mm: float | None = None) -> LandmarkPrior:
        """Prior of landmark positions (L, 3) in RAS mm, L >= 0; without ``radius_mm`` 0.15 rms radii of the organ."""
        radius = ON_SURFACE if radius_mm is None else radius_mm / samples.normalisation.length
        positions = samples.normalisation.apply(positions_mm.reshape(-1, 3))
        index = cKDTree(samples.points).query(positions)[1] if len(positions) else np.zeros(0, dtype=np.int64)
        return cls(positions, samples.normals[index], index, radius)

    def __len__(self) -> int:
        return len(self.positions)

    def cost(self, poses: Poses, view: SplatView) -> Array:
        """Penalty (B,) of poses T_camera_normalised, 0 to 0.15."""
        if not len(self):
            return np.zeros(len(poses))
        points = np.einsum("bij,lj->bli", poses.rotation, self.positions) * poses.scale[:, None, None]
        points += poses.translation[:, None]
        normals = np.einsum("bij,lj->bli", poses.rotation, self.normals)
        return landmark_cost(points, normals, poses.scale, view, self.radius)


def landmark_cost(points: Array, normals: Array, scale: Array, view: SplatView, radius: float) -> Array:
    """Penalty (B,) of landmarks at points (B, L, 3) with normals (B, L, 3), camera frame, for scales (B,)."""
    facing = -np.einsum("blk,blk->bl", normals, points) / np.linalg.norm(points, axis=-1)
    distance = view.tree.query(points.reshape(-1, 3))[0].reshape(facing.shape) / scale[:, None]
    cost = 2 * np.maximum(-facing, 0) + 3 * np.maximum(distance - radius, 0)
    return STRONGEST * np.clip(cost, 0, 1).mean(1)
