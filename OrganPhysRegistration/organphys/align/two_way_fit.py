"""Batched two-way robust fit of similarities: splat points to the organ, and organ points to the reference image.

Residuals of one pose, lengths in the normalised CT frame:
(a) splat sample -> nearest organ sample, point to plane; normals that disagree count as distance;
(b) organ sample that faces the camera, inside the mask and not far behind the seen surface -> the splat point of its
    pixel, point to plane: visible match and free space in one (deeper points count as self-occluded);
(c) organ sample in a known-empty pixel -> plane through the camera and the nearest mask edge (silhouette).
Robust cost e / (e + tau^2) (Geman-McClure). Organ samples that face the camera where nothing can be seen cost what
the image says (``CameraImage.unseen_cost``). Arrays are kept per axis, (B, points), float32: a third of the
time of (B, points, 3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..points.sampling import farthest_points, random_subset
from ..points.surface_samples import ClosestSampleGrid, SurfaceSamples
from .pose_residuals import Rows, Single, columns, dot, homogeneous, normal_equations, pick, transform, turn
from .poses import Poses
from .splat_view import SplatView

FACING = np.float32(0.15)


class TwoWayFit:
    """Scores and improves batches of poses T_camera_normalised with ``count`` points a side."""

    def __init__(
        self, samples: SurfaceSamples, grid: ClosestSampleGrid, view: SplatView, *, count: int, seed: int = 0
    ) -> None:
        surface, image = view.surface, view.image
        self.grid = grid
        self.organ = columns(samples.points), columns(samples.normals)
        splat_index = _subset(surface.samples, count, seed)
        organ_index = _subset(samples.points, count, seed)
        self.splat_points = homogeneous(surface.samples[splat_index])
        self.splat_normals = surface.sample_normals[splat_index].T.astype(np.float32)
        self.organ_points = homogeneous(samples.points[organ_index])
        self.organ_normals = samples.normals[organ_index].T.astype(np.float32)
        self.image = image
        self.front_points = tuple(c[image.front.ravel()] for c in columns(surface.points))
        self.front_normals = tuple(c[image.front.ravel()] for c in columns(surface.normals))
        self.front_distance = np.sqrt(sum(c * c for c in self.front_points))
        edge = image.centre(np.moveaxis(image.nearest, 0, -1).reshape(-1, 2)).astype(np.float32)
        self.edge = edge[:, 0].copy(), edge[:, 1].copy()
        self.seen = (image.mask & ~image.unknown).ravel()
        self.unknown = image.unknown.ravel()
        self.gap = image.gap.ravel()
        self.unseen_cost = image.unseen_cost.ravel()
        self.nearest_depth = np.float32(1e-3 * surface.radius)

    def score(self, poses: Poses, tau: float) -> tuple[Array, Array]:
        """Costs (B,) of the splat side (0..1) and of the camera side; their sum ranks poses."""
        return (
            self._splat_rows(poses, tau, rows=False).cost.astype(np.float64),
            self._camera_rows(poses, tau, rows=False).cost.astype(np.float64),
        )

    def step(self, poses: Poses, tau: float, *, damping: float, free_scale: bool = True) -> Poses:
        """One damped Gauss-Newton step of all seven parameters (six with a known scale) of every pose."""
        parts = self._splat_rows(poses, tau), self._camera_rows(poses, tau)
        hessian, gradient = (sum(x) for x in zip(*(normal_equations(p) for p in parts), strict=True))
        diagonal = np.trace(hessian, axis1=1, axis2=2)[:, None, None] / 7 * damping + 1e-12
        unknowns = 7 if free_scale else 6
        hessian = (hessian + diagonal * np.eye(7))[:, :unknowns, :unknowns]
        change = np.zeros((len(poses), 7))
        change[:, :unknowns] = -np.linalg.solve(hessian, gradient[:, :unknowns, None])[..., 0]
        limit = np.array([0.3, 0.3, 0.3, 0.4, 0.4, 0.4, 0.12])
        return poses.source_twist(np.clip(change, -limit, limit))

    def _splat_rows(self, poses: Poses, tau: float, *, rows: bool = True) -> Rows:
        tau2 = np.float32(tau * tau)
        to_ct = poses.rotation.transpose(0, 2, 1) / poses.scale[:, None, None]
        shift = -np.einsum("bij,bj->bi", to_ct, poses.translation)
        x = transform(to_ct, shift, self.splat_points)
        nearest = self.grid.lookup(*x)
        points, normals = self.organ
        n = tuple(c[nearest] for c in normals)
        d = tuple(a - c[nearest] for a, c in zip(x, points, strict=True))
        turned = transform(poses.rotation.transpose(0, 2, 1), None, self.splat_normals)
        error = dot(d, d) + np.float32(0.49) * tau2 * (1 - np.clip(dot(turned, n), -1, 1))
        cost = (error / (error + tau2)).mean(1)
        if not rows:
            return Rows(cost, cost, cost, x, x)
        weight = ((1 + error / tau2) ** -2).astype(np.float32, copy=False)
        return Rows(cost, weight, dot(n, d), x, n)

    def _camera_rows(self, poses: Poses, tau: float, *, rows: bool = True) -> Rows:
        tau2, scale = np.float32(tau * tau), poses.scale.astype(np.float32)[:, None]
        y = transform(poses.rotation * poses.scale[:, None, None], poses.translation, self.organ_points)
        n = transform(poses.rotation, None, self.organ_normals)
        distance = np.sqrt(dot(y, y))
        facing = -dot(n, y) / distance
        depth = np.maximum(y[2], self.nearest_depth)
        pixel, inside = self._pixels(y, depth)
        unknown = self.unknown[pixel] | ~inside
        seen = self.seen[pixel] & inside
        before = (self.front_distance[pixel] - distance) / scale  # > 0: before the seen surface
        front = seen & (facing > FACING) & (before > np.float32(-1.5 * tau))
        empty = ~(self.image.mask.ravel()[pixel] | unknown)
        beside = self.gap[pixel] * depth / scale
        towards = np.clip(facing, 0, 1)
        error = np.where(front, before * before, np.where(empty, beside * beside, 0))
        weight = np.where(front, towards, empty.astype(np.float32))
        unseen = np.where(unknown & (facing > FACING), towards, 0)
        unseen_cost, unseen = (unseen * self.unseen_cost[pixel]).sum(1), unseen.sum(1)
        total, count = weight.sum(1), np.float32(self.organ_points.shape[1])
        cost = (weight * error / (error + tau2)).sum(1) + unseen_cost
        cost /= np.maximum(total + unseen, 0.05 * count)
        if not rows:
            return Rows(cost, cost, cost, y, y)
        weight *= (1 + error / tau2) ** -2
        weight *= (self.splat_points.shape[1] / np.maximum(total, 0.15 * count))[:, None]
        target, normal = self._camera_targets(y, depth, pixel, empty)
        to_ct = poses.rotation.transpose(0, 2, 1).astype(np.float32)
        moved = tuple(a - t[:, None] for a, t in zip(target, poses.translation.T.astype(np.float32), strict=True))
        point = tuple(a / scale for a in turn(to_ct, moved))
        normal = turn(to_ct, normal)
        offset = tuple(a - q for a, q in zip(point, self.organ_points[:3], strict=True))
        return Rows(cost, weight, dot(offset, normal), point, normal)

    def _pixels(self, y: tuple[Single, ...], depth: Single) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
        """Flat pixel index (clamped) of camera-frame points, and which of them are in the image."""
        flat: NDArray[np.int32] = np.zeros(depth.shape, dtype=np.int32)
        inside = y[2] > 0
        for k, size in enumerate(self.image.mask.shape):
            index = np.floor((y[k] / depth - np.float32(self.image.low[k])) * np.float32(1 / self.image.pixel))
            inside &= (index >= 0) & (index < size)
            np.clip(index, 0, size - 1, out=index)
            flat = flat * np.int32(size) + index.astype(np.int32)
        return flat, inside

    def _camera_targets(
        self, y: tuple[Single, ...], depth: Single, pixel: NDArray[np.int32], empty: NDArray[np.bool_]
    ) -> tuple[tuple[Single, ...], tuple[Single, ...]]:
        """Target point and plane normal per organ sample, camera frame: seen splat point, or silhouette plane."""
        edge = tuple(c[pixel] for c in self.edge)
        across = tuple(y[k] - edge[k] * depth for k in range(2))
        length = np.maximum(np.sqrt(across[0] ** 2 + across[1] ** 2), np.float32(1e-9))
        u, v = across[0] / length, across[1] / length
        w = -(u * edge[0] + v * edge[1])  # the plane holds the camera and the edge's ray
        norm = np.maximum(np.sqrt(u * u + v * v + w * w), np.float32(1e-9))
        plane_point = edge[0] * depth, edge[1] * depth, depth
        plane_normal = u / norm, v / norm, w / norm
        return (
            pick(empty, plane_point, tuple(c[pixel] for c in self.front_points)),
            pick(empty, plane_normal, tuple(c[pixel] for c in self.front_normals)),
        )


def _subset(points: Array, count: int, seed: int) -> NDArray[np.int64]:
    """Few points are spread out by farthest-point sampling, many drawn at random."""
    return farthest_points(points, count) if count <= 150 else random_subset(len(points), count, seed)
