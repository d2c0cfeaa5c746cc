"""Signed distance to a closed triangle surface: positive outside, negative inside."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..points.neighbours import nearest_neighbours
from ..points.sampling import one_per_cell
from .in_chunks import in_chunks

CHUNK = 8192


def vertex_normals(vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Angle-weighted unit normals (Nv, 3) of a triangle mesh, outward for counter-clockwise faces.

    Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal", TVCG 2005.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    face_normals = _unit(np.cross(b - a, c - a))
    normals = np.zeros_like(vertices)
    for k, (p, q, r) in enumerate(((a, b, c), (b, c, a), (c, a, b))):
        angles = np.arccos(np.clip((_unit(q - p) * _unit(r - p)).sum(1), -1, 1))
        for axis in range(3):
            normals[:, axis] += np.bincount(faces[:, k], angles * face_normals[:, axis], len(vertices))
    return _unit(normals)


def closest_on_triangles(points: Array, a: Array, b: Array, c: Array) -> Array:
    """Barycentric coordinates (..., 3) of the closest point of every triangle a, b, c (..., 3) to its point.

    The regions are those of Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.
    """
    ab, ac, ap = b - a, c - a, points - a
    d1, d2 = _dot(ab, ap), _dot(ac, ap)
    aa, bb, cc = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac)
    determinant = np.maximum(aa * cc - bb * bb, 1e-300)
    v, w = (cc * d1 - bb * d2) / determinant, (aa * d2 - bb * d1) / determinant
    inside = (v >= 0) & (w >= 0) & (v + w <= 1)
    best = np.stack([1 - v - w, v, w], axis=-1)
    nearest = np.where(inside, 0.0, np.inf)
    for start, end, base, edge in ((0, 1, ap, ab), (0, 2, ap, ac), (1, 2, points - b, c - b)):
        t = np.clip(_dot(base, edge) / np.maximum(_dot(edge, edge), 1e-300), 0, 1)
        gap = base - t[..., None] * edge
        squared = _dot(gap, gap)
        closer = squared < nearest
        candidate = np.zeros_like(best)
        candidate[..., start], candidate[..., end] = 1 - t, t
        best[closer], nearest[closer] = candidate[closer], squared[closer]
    return best


@dataclass(frozen=True)
class SurfaceDistance:
    """Distance to the surface vertices (Nv, 3), faces (Nf, 3), in the unit of the vertices.

    The closest point is sought on the triangles round the nearest vertex; the sign is that of the vertex normals
    interpolated there.
    """

    vertices: Array
    faces: NDArray[np.int64]

    def signed(self, points: Array) -> Array:
        """Signed distance (N,) of the points (N, 3)."""
        return self.signed_with_foot(points)[0]

    def signed_with_foot(self, points: Array) -> tuple[Array, Array]:
        """Signed distance (N,) and the closest surface point (N, 3)."""
        nearest = nearest_neighbours(self._tree, points)[1]
        around, normals = self._faces_of_vertex, self.normals
        distance, foot = np.empty(len(points)), np.empty((len(points), 3))

        def evaluate(part: slice) -> None:
            distance[part], foot[part] = self._one_ring(points[part], self.faces[around[nearest[part]]], normals)

        in_chunks(len(points), CHUNK, evaluate)
        return distance, foot

    def outside(self, points: Array) -> Array:
        """Distance (N,) outside the surface, 0 inside; fast: farther than 6 % of its size it may be 5 % too long."""
        edges = np.linalg.norm(self.vertices[self.faces[:, 0]] - self.vertices[self.faces[:, 1]], axis=1)
        cell = max(0.02 * float(np.ptp(self.vertices, axis=0).max()), float(np.median(edges)))
        thin = one_per_cell(self.vertices, cell)
        gap, nearest = nearest_neighbours(cKDTree(self.vertices[thin]), points)
        vertex = thin[nearest]
        distance = np.where(_dot(points - self.vertices[vertex], self.normals[vertex]) < 0, 0.0, gap)
        near = np.flatnonzero(gap < 3 * cell)
        distance[near] = np.maximum(self.signed(points[near]), 0.0)
        return distance

    def samples(self, spacing: float) -> Array:
        """Surface points (N, 3), the vertices among them, about ``spacing`` apart or closer; at most 8 per edge."""
        corners = self.vertices[self.faces]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(1)
        parts = np.clip(np.ceil(longest / spacing), 1, 8).astype(np.int64)
        points = [self.vertices]
        for count in np.unique(parts[parts > 1]):
            i, j = (k.ravel() for k in np.mgrid[: count + 1, : count + 1])
            weights = np.stack([count - i - j, i, j], axis=1)[i + j <= count] / count
            points.append(np.einsum("kj,njd->nkd", weights, corners[parts == count]).reshape(-1, 3))
        return np.concatenate(points)

    def _one_ring(self, points: Array, triangles: NDArray[np.int64], normals: Array) -> tuple[Array, Array]:
        """Signed distance (n,) and foot (n, 3) of points (n, 3) on their own triangles (n, 8, 3)."""
        corners = self.vertices[triangles]
        weights = closest_on_triangles(points[:, None], corners[:, :, 0], corners[:, :, 1], corners[:, :, 2])
        gaps = points[:, None] - np.einsum("nkj,nkjd->nkd", weights, corners)
        best = _dot(gaps, gaps).argmin(1)[:, None, None]
        gap = np.take_along_axis(gaps, best, axis=1)[:, 0]
        weight = np.take_along_axis(weights, best, axis=1)[:, 0]
        corner = np.take_along_axis(triangles, best, axis=1)[:, 0]
        normal = np.einsum("nj,njd->nd", weight, normals[corner])
        return np.where(_dot(gap, normal) < 0, -1.0, 1.0) * np.linalg.norm(gap, axis=1), points - gap

    @cached_property
    def normals(self) -> Array:
        """Outward unit normals (Nv, 3)."""
        return vertex_normals(self.vertices, self.faces)

    @cached_property
    def _tree(self) -> cKDTree:
        used = np.bincount(self.faces.ravel(), minlength=len(self.vertices)) > 0
        return cKDTree(np.where(used[:, None], self.vertices, self.vertices[self.faces[0, 0]]))

    @cached_property
    def _faces_of_vertex(self) -> NDArray[np.int64]:
        """(Nv, 8): faces round every vertex, the first one repeated; of more than 8 some are left out."""
        order = np.argsort(self.faces.ravel(), kind="stable")
        corner = self.faces.ravel()[order]
        starts = np.searchsorted(corner, np.arange(len(self.vertices)))
        counts = np.bincount(corner, minlength=len(self.vertices))
        slot = np.minimum(np.arange(8)[None], np.maximum(counts - 1, 0)[:, None])
        return order[np.minimum(starts[:, None] + slot, len(order) - 1)] // 3


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("...d,...d->...", a, b)
    return product


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
