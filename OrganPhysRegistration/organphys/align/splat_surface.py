"""The splat's opaque centres made into a clean, evenly sampled, oriented surface.

Works in the camera frame (camera at the origin, z forward), raw scene units.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError
from ..points.neighbours import nearest_neighbours
from ..points.sampling import cell_keys, random_subset
from ..points.target_selection import CleaningOptions, clean_points
from .surface_patches import on_patches


@dataclass(frozen=True)
class SplatSurfaceOptions:
    """Counts of points and neighbours: ``centres`` are cleaned and shape mask and rim; up to ``dense`` more that lie on
    them are averaged into ``samples`` (a mean over more Gaussians is less noisy), each of which is put on a smooth
    patch through the nearest ``patch`` of all centres: a fraction, so that it covers as much surface of a sparse splat.
    """

    centres: int = 100_000
    dense: int = 200_000
    cleaning: CleaningOptions = field(default_factory=CleaningOptions)
    normal_neighbours: int = 25
    samples: int = 2500
    patch: float = 0.0025
    fewest_in_patch: int = 60

    def in_patch(self, count: int) -> int:
        """Points of a patch where there are ``count`` in all."""
        return max(self.fewest_in_patch, round(self.patch * count))


@dataclass(frozen=True)
class SplatSurface:
    """points (C, 3), normals (C, 3): cleaned centres; samples (M, 3), sample_normals (M, 3): cell averages
    put on smooth patches.

    Normals are unit and point towards the camera. ``spacing`` (median neighbour distance) and ``radius`` (rms
    distance from the centroid) are in scene units.
    """

    points: Array
    normals: Array
    samples: Array
    sample_normals: Array
    spacing: float
    radius: float

    @property
    def centre(self) -> Array:
        """Median of the cleaned centres (3,)."""
        return np.median(self.points, axis=0)

    @cached_property
    def plane(self) -> Array:
        """The points on the image plane at z = 1 (C, 2)."""
        return self.points[:, :2] / self.points[:, 2:]

    @cached_property
    def plane_tree(self) -> cKDTree:
        """KD-tree over ``plane``."""
        return cKDTree(self.plane)


def splat_surface(centres: Array, *, options: SplatSurfaceOptions | None = None, seed: int = 0) -> SplatSurface:
    """Clean, orient and thin opaque Gaussian centres (N, 3), camera frame. InputError if hardly any are left."""
    options = options or SplatSurfaceOptions()
    points, spacing = cleaned_centres(centres, options, seed)
    normals = towards_camera(points, plane_normals(points, options.normal_neighbours))
    dense, dense_normals = _neighbourhood(centres, points, normals, spacing, options.dense, seed)
    count = min(options.samples, len(dense) // 3)  # a sparse splat needs larger cells, or each would hold one point
    samples, sample_normals = cell_averages(dense, dense_normals, count)
    samples, sample_normals = on_patches(points, samples, sample_normals, neighbours=options.in_patch(len(points)))
    sample_normals = towards_camera(samples, sample_normals)
    return SplatSurface(points, normals, samples, sample_normals, spacing, rms_radius(points))


def cleaned_centres(centres: Array, options: SplatSurfaceOptions, seed: int) -> tuple[Array, float]:
    """Cleaned points (C, 3) of the centres (N, 3) and their spacing. InputError where too few are left."""
    points = centres[random_subset(len(centres), options.centres, seed)].astype(np.float64)
    cleaning = clean_points(points, options=options.cleaning)
    return enough(points[cleaning.keep], options), cleaning.spacing


def enough(points: Array, options: SplatSurfaceOptions) -> Array:
    """The points (N, 3) that make the surface; InputError where they are too few."""
    if len(points) < 4 * options.normal_neighbours:
        raise InputError(
            f"splat: only {len(points)} opaque Gaussians form a surface; "
            "lower the opacity threshold, widen the ROI or check the file"
        )
    return points


def rms_radius(points: Array) -> float:
    """Root mean square distance of points (N, 3) from their centroid."""
    return float(np.sqrt(((points - points.mean(0)) ** 2).sum(1).mean()))


def _neighbourhood(
    centres: Array, points: Array, normals: Array, spacing: float, most: int, seed: int
) -> tuple[Array, Array]:
    """All centres within one ``spacing`` of a cleaned point, with that point's normal."""
    candidates = centres[random_subset(len(centres), most, seed)].astype(np.float64)
    distance, nearest = nearest_neighbours(cKDTree(points), candidates, distance_upper_bound=spacing)
    near = np.isfinite(distance)
    return candidates[near], normals[nearest[near]]


def plane_normals(points: Array, neighbours: int) -> Array:
    """Unit normals (N, 3) of the least-squares planes of each point's neighbourhood, sign arbitrary."""
    index = nearest_neighbours(cKDTree(points), points, k=neighbours)[1]
    local = points[index]
    local -= local.mean(1, keepdims=True)
    return np.linalg.eigh(local.transpose(0, 2, 1) @ local)[1][:, :, 0]


def towards_camera(points: Array, normals: Array) -> Array:
    """The normals turned to face a camera at the origin."""
    facing = np.einsum("ij,ij->i", normals, points)
    return normals * np.where(facing > 0, -1.0, 1.0)[:, None]


def cell_averages(points: Array, normals: Array, count: int) -> tuple[Array, Array]:
    """Points and normals averaged over cubic cells, the cell chosen so that about ``count`` are occupied.

    Cells with less than a quarter of the mean number of points are left out: they are the noisiest.
    """
    cell = rms_radius(points) / 25
    for _ in range(12):
        keys = cell_keys(points, cell)
        occupied = len(np.unique(keys))
        if occupied > 1.1 * count:
            cell *= 1.06
        elif occupied < 0.9 * count:
            cell *= 0.95
        else:
            break
    _, inverse, number = np.unique(cell_keys(points, cell), return_inverse=True, return_counts=True)
    kept = number >= max(2, 0.25 * number.mean())

    def average(values: Array) -> NDArray[np.float64]:
        return np.stack([np.bincount(inverse, values[:, k])[kept] / number[kept] for k in range(3)], axis=1)

    mean_normal = average(normals)
    return average(points), mean_normal / np.linalg.norm(mean_normal, axis=1, keepdims=True)
