"""Landmarks as a prior: the clicked place of the organ should face the camera and lie on the seen surface.

One that was clicked on the splat as well should lie there, within some tenths of the organ's radius: both clicks err.
"""

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
PAIRED_WIDTH = 0.4  # robust width of the distance to the place clicked on the splat, normalised length
STRONGEST_PAIR = 0.4  # two clicks know more than one
STRONGEST = 0.15  # a landmark may tip the choice between near-equal poses, never overrule the data


@dataclass(frozen=True)
class LandmarkPrior:
    """Landmarks on the organ surface, normalised CT frame: index (L,) of the nearest surface sample of each; within
    ``radius`` (normalised length) of the seen surface one counts as met. partners (L, 3): the places clicked on the
    splat, camera frame, nan where there is none."""

    positions: Array
    normals: Array
    sample_index: NDArray[np.int64]
    radius: float = ON_SURFACE
    partners: Array | None = None

    @classmethod
    def of(
        cls,
        positions_mm: Array,
        samples: SurfaceSamples,
        *,
        radius_mm: float | None = None,
        partners: Array | None = None,
    ) -> LandmarkPrior:
        """Prior of landmark positions (L, 3) in RAS mm, L >= 0; without ``radius_mm`` 0.15 rms radii of the organ."""
        radius = ON_SURFACE if radius_mm is None else radius_mm / samples.normalisation.length
        positions = samples.normalisation.apply(positions_mm.reshape(-1, 3))
        partners = None if partners is None or not np.isfinite(partners).any() else partners
        index = cKDTree(samples.points).query(positions)[1] if len(positions) else np.zeros(0, dtype=np.int64)
        return cls(positions, samples.normals[index], index, radius, partners)

    def __len__(self) -> int:
        return len(self.positions)

    def cost(self, poses: Poses, view: SplatView) -> Array:
        """Penalty (B,) of poses T_camera_normalised, 0 to 0.15, with pairs to 0.55."""
        if not len(self):
            return np.zeros(len(poses))
        points = np.einsum("bij,lj->bli", poses.rotation, self.positions) * poses.scale[:, None, None]
        points += poses.translation[:, None]
        normals = np.einsum("bij,lj->bli", poses.rotation, self.normals)
        return self.cost_at(points, normals, poses.scale, view)

    def cost_at(self, points: Array, normals: Array, scale: Array, view: SplatView) -> Array:
        """Penalty (B,) of the landmarks at points (B, L, 3) with normals (B, L, 3), camera frame, for scales (B,)."""
        cost = landmark_cost(points, normals, scale, view, self.radius)
        if self.partners is None:
            return cost
        paired = np.isfinite(self.partners).all(1)
        offset = (points[:, paired] - self.partners[paired]) / scale[:, None, None]
        squared = (offset**2).sum(2)
        return cost + STRONGEST_PAIR * (squared / (squared + PAIRED_WIDTH**2)).mean(1)


def landmark_cost(points: Array, normals: Array, scale: Array, view: SplatView, radius: float) -> Array:
    """Penalty (B,) of landmarks at points (B, L, 3) with normals (B, L, 3), camera frame, for scales (B,)."""
    facing = -np.einsum("blk,blk->bl", normals, points) / np.linalg.norm(points, axis=-1)
    distance = view.tree.query(points.reshape(-1, 3))[0].reshape(facing.shape) / scale[:, None]
    cost = 2 * np.maximum(-facing, 0) + 3 * np.maximum(distance - radius, 0)
    return STRONGEST * np.clip(cost, 0, 1).mean(1)
