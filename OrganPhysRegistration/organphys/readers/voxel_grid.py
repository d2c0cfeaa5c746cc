"""Where the voxels of an array lie: index order (k, j, i) as numpy shows a SimpleITK image, world RAS mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..ground.checks import Array, InputError

SMALLEST_MM, LARGEST_MM = 1e-5, 1e6  # edge of a voxel; the origin may lie a thousand times farther
LEAST_SPAN = 1e-6  # volume of a voxel over that of its edges put at right angles


@dataclass(frozen=True)
class VoxelGrid:
    """shape (3,) in index order (k, j, i); origin_ras (3,) mm: centre of voxel (0, 0, 0); step_ras (3, 3) mm: columns
    are the world steps along k, j and i, which may be oblique, mirrored or sheared."""

    shape: tuple[int, int, int]
    origin_ras: Array
    step_ras: Array

    @classmethod
    def of_affine(cls, shape: tuple[int, ...], ijk_to_ras: ArrayLike) -> VoxelGrid:
        """Grid of an array (K, J, I) and the affine (4, 4) from its (i, j, k) indices to RAS mm; InputError if
        singular or not finite."""
        try:
            affine = np.asarray(ijk_to_ras, dtype=np.float64)
        except (TypeError, ValueError):
            affine = np.zeros(0)
        if affine.shape != (4, 4) or not np.isfinite(affine).all() or not np.allclose(affine[3], [0, 0, 0, 1]):
            raise InputError("voxel geometry: expected a finite affine (4, 4) with the last row 0 0 0 1")
        grid = cls((shape[0], shape[1], shape[2]), affine[:3, 3].copy(), affine[:3, 2::-1].copy())
        check_extent(grid, "voxel geometry")
        return grid

    @property
    def spacing_mm(self) -> Array:
        """Voxel edge lengths (3,) along k, j, i."""
        spacing: Array = np.linalg.norm(self.step_ras, axis=0)
        return spacing

    @property
    def voxel_ml(self) -> float:
        """Volume of a voxel, also where its edges are not perpendicular."""
        return abs(float(np.linalg.det(self.step_ras))) / 1000

    def world(self, index: Array | NDArray[np.int64]) -> Array:
        """RAS mm positions (N, 3) of indices (N, 3) in (k, j, i) order."""
        positions: Array = np.asarray(index, dtype=np.float64) @ self.step_ras.T + self.origin_ras
        return positions


def check_extent(grid: VoxelGrid, name: str) -> None:
    """InputError where voxels have no extent, none that a body has, or lie beyond all bodies."""
    edges = np.abs(grid.step_ras).max(axis=0)
    if not (np.isfinite(grid.step_ras).all() and (edges >= SMALLEST_MM).all() and (edges <= LARGEST_MM).all()):
        raise InputError(f"{name}: voxel spacing is no length in mm, so its axes do not span a volume; repair it")
    if not (np.abs(grid.origin_ras) <= 1000 * LARGEST_MM).all():
        raise InputError(f"{name}: the origin of the voxels is not a place in mm; repair the header")
    first, second, third = (grid.step_ras / grid.spacing_mm).T
    if not abs(first @ np.cross(second, third)) >= LEAST_SPAN:  # det warns of some singular matrices
        raise InputError(f"{name}: the voxels' axes do not span a volume; check the spacing and the transform")
