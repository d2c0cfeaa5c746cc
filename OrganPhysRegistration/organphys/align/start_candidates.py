"""Candidate poses that cover all view directions, twists about the viewing axis and plausible scales."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array
from ..points.surface_samples import SurfaceSamples
from .poses import Poses
from .splat_view import SplatView


@dataclass(frozen=True)
class CandidateOptions:
    """``factors`` multiply the scale at which the organ's silhouette has the area of the seen mask."""

    views: int = 150
    twists: int = 18
    factors: tuple[float, ...] = (0.92, 1.1, 1.35, 1.65)
    silhouette_cell: float = 0.06


@dataclass(frozen=True)
class Candidates:
    """poses T_camera_normalised and the range of scale (scene units per normalised length) that stays plausible."""

    poses: Poses
    scale_range: tuple[float, float]


def start_candidates(
    samples: SurfaceSamples,
    view: SplatView,
    *,
    landmark_normals: Array | None = None,
    scale: float | None = None,
    options: CandidateOptions | None = None,
    seed: int = 0,
) -> Candidates:
    """All combinations of view, twist and scale; the organ's front surface is put on the splat's centroid.

    landmark_normals (L, 3): outward organ normals at landmarks; views from which one faces away are left out.
    ``scale`` replaces the scale factors where the unit is known.
    """
    options = options or CandidateOptions()
    directions = fibonacci_sphere(options.views) @ np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    if landmark_normals is not None and len(landmark_normals):
        facing = (landmark_normals @ directions.T).min(0) >= -0.1
        directions = directions[facing] if facing.any() else directions
    seen_area = _mask_area(view)
    towards_camera = -view.surface.centre / np.linalg.norm(view.surface.centre)
    target = view.surface.samples.mean(0)
    twists = 2 * np.pi * np.arange(options.twists) / options.twists
    parts, base_scales = [], []
    for direction in directions:
        area, front = _silhouette(samples, direction, options.silhouette_cell)
        base = float(np.sqrt(seen_area / area))
        base_scales.append(base)
        scales = np.array([scale]) if scale else base * np.array(options.factors)
        parts.append(_poses_of_view(direction, towards_camera, twists, scales, front, target))
    return Candidates(Poses.join(parts), (0.6 * min(base_scales), 2.5 * float(np.median(base_scales))))


def fibonacci_sphere(count: int) -> Array:
    """Unit vectors (count, 3) spread evenly by the golden-angle spiral."""
    i = np.arange(count) + 0.5
    z, azimuth = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=1)


def _mask_area(view: SplatView) -> float:
    """Area of the seen surface across the view, square scene units: pixel area at the distance of each pixel."""
    image = view.image
    distance = np.linalg.norm(view.surface.points[image.front[image.mask]], axis=1)
    return float(((image.pixel * distance) ** 2).sum())


def _silhouette(samples: SurfaceSamples, direction: Array, cell: float) -> tuple[float, Array]:
    """Area of the orthographic silhouette seen from ``direction`` and centroid (3,) of the front surface."""
    height = samples.points @ direction
    plane = samples.points @ _perpendicular(direction).T
    index = np.floor((plane - plane.min(0)) / cell).astype(np.int64)
    _, inverse = np.unique(index[:, 0] * 100_003 + index[:, 1], return_inverse=True)
    highest = np.full(inverse.max() + 1, -np.inf)
    np.maximum.at(highest, inverse, height)
    front = (height > highest[inverse] - 0.1) & (samples.normals @ direction > 0.15)
    return len(highest) * cell**2, samples.points[front].mean(0) if front.any() else samples.points.mean(0)


def _perpendicular(direction: Array) -> Array:
    """Two unit rows (2, 3) that make a right-handed frame with ``direction``."""
    first = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


def _poses_of_view(
    direction: Array, towards_camera: Array, twists: Array, scales: Array, front: Array, target: Array
) -> Poses:
    """Poses that turn ``direction`` (CT) towards the camera, for all twists and scales."""
    u, v = _perpendicular(towards_camera)
    e, f = _perpendicular(direction)
    first = np.cos(twists)[:, None] * u + np.sin(twists)[:, None] * v
    second = -np.sin(twists)[:, None] * u + np.cos(twists)[:, None] * v
    rotation = first[:, :, None] * e + second[:, :, None] * f + np.outer(towards_camera, direction)
    rotation = np.repeat(rotation, len(scales), axis=0)
    scale = np.tile(scales, len(twists))
    return Poses(scale, rotation, target - scale[:, None] * (rotation @ front))
