"""The three data terms of the default method: splat to organ, visible organ to splat, and the true rim.

Each is a weighted mean, so that its strength depends on no number of points; lengths are normalised.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..align.splat_view import SplatView
from ..ground.checks import Array
from .matches import Deformed, Matches, geman_mcclure
from .visibility import Visibility


@dataclass(frozen=True)
class DataOptions:
    """Weights of the terms; ``plane``: share of the metric along the normal; ``normal_weight``: of unit normals in the
    nearest-neighbour search; ``rim_window``: lateral half width of a rim ray in sample spacings; ``lateral_noise``: of
    splat points across their rays, as a fraction of that along them (1: the same); ``free_only``: tissue held away from
    the organ is left out."""

    splat_weight: float = 1.0
    organ_weight: float = 1.0
    rim_weight: float = 1.0
    plane: float = 0.9
    normal_weight: float = 0.3
    rim_window: float = 1.2
    lateral_noise: float = 0.25
    free_only: bool = True


def splat_matches(organ: Deformed, view: SplatView, tau: float, options: DataOptions) -> Matches:
    """Every splat sample and its nearest organ sample in position and normal."""
    targets = organ.target_frame(view.surface.samples)
    normals = view.surface.sample_normals @ organ.start.rotation
    tree = cKDTree(np.hstack([organ.points, options.normal_weight * organ.normals]))
    distance, rows = tree.query(np.hstack([organ.gamma * targets, options.normal_weight * normals]))
    weights = options.splat_weight / len(targets) * geman_mcclure(distance**2, tau)
    weights *= precision(view.surface.samples, organ.start.turn(organ.normals[rows]), options.lateral_noise)
    return Matches(rows, targets, weights, organ.normals[rows], np.full(len(rows), options.plane))


def organ_matches(
    organ: Deformed,
    view: SplatView,
    seen: Visibility,
    chosen: NDArray[np.int64],
    tau: float,
    options: DataOptions,
    free: Array | None = None,
) -> Matches:
    """The ``chosen`` organ samples that should be visible and their nearest splat samples, of which those weigh by
    ``free`` (M,)."""
    rows = chosen[seen.front[chosen]]
    if len(rows) <= 20:
        rows = rows[:0]
    distance, nearest = view.tree.query(seen.points[rows])
    weights = geman_mcclure((distance / organ.pose.scale) ** 2, tau) * np.clip(seen.facing[rows], 0, 1)
    weights *= precision(view.surface.samples[nearest], organ.start.turn(organ.normals[rows]), options.lateral_noise)
    weights *= 1.0 if free is None else free[nearest]
    return Matches(
        rows,
        organ.target_frame(view.surface.samples[nearest]),
        options.organ_weight / max(len(rows), 1) * weights,
        view.surface.sample_normals[nearest] @ organ.start.rotation,
        np.full(len(rows), options.plane),
    )


def precision(points: Array, normals: Array, lateral_noise: float) -> Array:
    """How exactly splat points (K, 3; camera frame) place a surface along its unit normals (K, 3): mean 1.

    Reconstruction errs along the ray; a surface seen at a grazing angle is hardly moved by that. With unit noise along
    the ray and ``lateral_noise`` across, the variance along the normal is cos^2 + lateral_noise^2 sin^2.
    """
    cosine2 = np.einsum("ij,ij->i", points, normals) ** 2 / np.maximum((points**2).sum(1), 1e-300)
    found: Array = 1 / (cosine2 + lateral_noise**2 * (1 - cosine2))
    return found / found.mean() if len(found) else found


def rim_matches(
    organ: Deformed, view: SplatView, seen: Visibility, spacing: float, tau: float, options: DataOptions
) -> Matches:
    """Per true rim ray the outermost organ sample beside it, to the plane through the camera and the rim's tangent."""
    rim, pose = view.rim, organ.pose
    if len(rim.points) <= 10:
        return _nothing()
    plane = seen.points[:, :2] / seen.points[:, 2:]
    per_length = pose.scale / float(np.median(seen.points[:, 2]))  # image-plane size of a normalised length
    reach, window = max(2 * tau, 0.1) * per_length, options.rim_window * spacing * per_length
    ray, row, beyond = _outermost_per_ray(plane, rim.points, rim.normals, reach, window)
    if not len(ray):
        return _nothing()
    depth = seen.points[row, 2]
    normals = np.column_stack([rim.normals[ray], -np.einsum("ij,ij->i", rim.points[ray], rim.normals[ray])])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    on_ray = np.column_stack([rim.points[ray], np.ones(len(ray))]) * depth[:, None]
    weights = geman_mcclure((beyond * depth / pose.scale) ** 2, tau)
    share = min(1.0, len(rim.points) / 100) / len(rim.points)
    return Matches(
        row,
        organ.target_frame(on_ray),
        options.rim_weight * share * weights,
        normals @ organ.start.rotation,
        np.ones(len(ray)),
    )


def _outermost_per_ray(
    plane: Array, rim_points: Array, rim_normals: Array, reach: float, window: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Rays that have samples beside them, the outermost sample of each, and how far it lies beyond the rim (signed)."""
    near = cKDTree(rim_points).query(plane, distance_upper_bound=float(np.hypot(reach, window)))[0]
    candidates = np.flatnonzero(np.isfinite(near))
    if not len(candidates):
        return candidates, candidates, np.zeros(0)
    tangents = np.column_stack([-rim_normals[:, 1], rim_normals[:, 0]])
    beside = plane[candidates].T
    along, across = (
        axes @ beside - np.einsum("ij,ij->i", axes, rim_points)[:, None] for axes in (rim_normals, tangents)
    )
    along[(np.abs(across) >= window) | (np.abs(along) >= reach)] = -np.inf
    best = along.argmax(1)
    beyond = along[np.arange(len(best)), best]
    ray = np.flatnonzero(np.isfinite(beyond) & (beyond < 0.98 * reach))
    return ray, candidates[best[ray]], beyond[ray]


def _nothing() -> Matches:
    empty, vectors = np.zeros(0), np.zeros((0, 3))
    return Matches(np.zeros(0, dtype=np.int64), vectors, empty, vectors, empty)
