"""An asymmetric organ with known shape, and what a camera sees of it under a known pose and deformation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from asset_examples import ellipsoid

from organphys.align.splat_view import SplatView, splat_view
from organphys.ground.checks import Array
from organphys.ground.frames import Similarity, rotation_about, rotation_between
from organphys.points.point_sets import Camera, GaussianCloud, Organ
from organphys.readers.mask_surface import smoothed_normals

CENTRE_MM = np.array([30.0, -55.0, 120.0])
AXES_MM = np.array([52.0, 42.0, 30.0])
BUMPS = (  # direction, height, width: lobes, and a fissure on the side that the camera sees
    ((1.0, 0.3, 0.2), 0.55, 0.25), ((-0.6, 0.8, 0.1), 0.6, 0.12), ((-0.5, -0.7, 0.3), 0.35, 0.1),
    ((0.1, 0.25, 0.9), -0.3, 0.12), ((0.0, -0.5, -0.8), 0.3, 0.3),
)  # fmt: skip
MM_PER_UNIT = 30.0
FRONT_CT = np.array([0.25, -0.3, 0.92])  # the side that faces the camera
ROTATION = rotation_about(np.array([0.0, 0.0, 1.0]), 0.7) @ rotation_between(FRONT_CT, np.array([0.0, 0.0, -1.0]))
POSE = Similarity(1 / MM_PER_UNIT, ROTATION, np.array([0.3, -0.2, 5.5]) - ROTATION @ CENTRE_MM / MM_PER_UNIT)

Deformation = Callable[[Array], Array]


def radius_factor(directions: Array) -> Array:
    """The bumps: factor (N,) on the ellipsoid's radius along unit directions (N, 3)."""
    factor = np.ones(len(directions))
    for towards, height, width in BUMPS:
        centre = np.array(towards) / np.linalg.norm(towards)
        factor += height * np.exp(-((directions - centre) ** 2).sum(1) / width)
    return factor


def bumpy_organ(*, rings: int = 40, around: int = 72, voxel_mm: float = 4.0, name: str = "organ") -> Organ:
    """Closed star-shaped surface about CENTRE_MM with its voxel centres; 0.4 litres."""
    sphere, faces = ellipsoid(rings, around)
    directions = sphere - sphere.mean(0)
    directions /= np.array([60.0, 35.0, 25.0])  # the axes of that ellipsoid
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    vertices = CENTRE_MM + directions * radius_factor(directions)[:, None] * AXES_MM
    inside, boundary = _voxels(voxel_mm)
    return Organ(
        vertices=vertices,
        faces=faces,
        vertex_normals=smoothed_normals(vertices, faces, rounds=0),
        volume_points=inside,
        boundary=boundary,
        spacing_mm=np.full(3, voxel_mm),
        volume_ml=len(inside) * voxel_mm**3 / 1000,
        name=name,
    )


def level(points: Array) -> Array:
    """Below 1 inside the organ, at points (N, 3) RAS mm."""
    scaled = (points - CENTRE_MM) / AXES_MM
    length = np.maximum(np.linalg.norm(scaled, axis=1), 1e-9)
    return length / radius_factor(scaled / length[:, None])


def _voxels(voxel_mm: float) -> tuple[Array, Array]:
    axes = [np.arange(-1.6 * a, 1.6 * a, voxel_mm) for a in AXES_MM]
    grid = CENTRE_MM + np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    inside = grid[level(grid) < 1]
    steps = voxel_mm * np.concatenate([np.eye(3), -np.eye(3)])
    return inside, np.any([level(inside + step) >= 1 for step in steps], axis=0)


def bend(points: Array) -> Array:
    """Smooth deformation of up to some 17 mm that keeps volume: a parabolic shear and a twist of the long axis."""
    x = (points - CENTRE_MM) / 60.0
    out = points.copy()
    out[:, 2] += 10 * x[:, 0] ** 2
    out[:, 1] += 7 * np.sin(1.5 * x[:, 0])
    return out


def unbent(points: Array) -> Array:
    return points


@dataclass(frozen=True)
class Seen:
    """What the camera saw: points (N, 3) in the scene with noise, and the same points (N, 3) in the CT, RAS mm."""

    points: Array
    points_ct: Array

    @property
    def cloud(self) -> GaussianCloud:
        count = len(self.points)
        return GaussianCloud(
            self.points.astype(np.float32), np.full(count, 0.9), np.full((count, 3), 0.5), np.ones(count, dtype=bool)
        )

    def view(self, **options: object) -> SplatView:
        return splat_view(self.points, np.zeros((0, 3)), Camera(), **options)  # type: ignore[arg-type]


def seen_from_camera(
    organ: Organ, *, deformation: Deformation = unbent, pose: Similarity = POSE, noise_mm: float = 0.3,
    count: int = 9000, seed: int = 0,
) -> Seen:  # fmt: skip
    """Dense samples of the deformed surface that a camera at the scene's origin sees (depth buffer)."""
    rng = np.random.default_rng(seed)
    deformed = deformation(organ.vertices)
    corners, moved = organ.vertices[organ.faces], deformed[organ.faces]
    area_vector = np.cross(moved[:, 1] - moved[:, 0], moved[:, 2] - moved[:, 0])
    area = np.linalg.norm(area_vector, axis=1)
    face = rng.choice(len(area), 3 * count, p=area / area.sum())
    share = rng.dirichlet([1.0, 1.0, 1.0], len(face))[:, None, :]
    points_ct, points = (share @ corners[face])[:, 0], pose.apply((share @ moved[face])[:, 0])
    facing = -np.einsum("ij,ij->i", pose.turn(area_vector[face] / area[face, None]), points)
    facing /= np.linalg.norm(points, axis=1)
    seen = (facing > 0.05) & _before_all(points, 3.0 * pose.scale)
    noise = noise_mm * pose.scale * rng.normal(size=(int(seen.sum()), 3))
    return Seen(points[seen] + noise, points_ct[seen])


def _before_all(points: Array, cell: float) -> Array:
    """(N,) bool: at most two cells behind the nearest point of the same image cell."""
    index = np.floor(points[:, :2] / points[:, 2:] * np.median(points[:, 2]) / cell).astype(np.int64)
    _, inverse = np.unique(index, axis=0, return_inverse=True)
    nearest = np.full(inverse.max() + 1, np.inf)
    np.minimum.at(nearest, inverse.ravel(), points[:, 2])
    return points[:, 2] < nearest[inverse.ravel()] + 2 * cell


def map_error(mapped: Array, truth: Array, mm_per_unit: float = MM_PER_UNIT) -> float:
    """Root mean square distance in mm of mapped points (N, 3) from the truth (N, 3), scene units."""
    return float(np.sqrt(((mapped - truth) ** 2).sum(1).mean()) * mm_per_unit)
