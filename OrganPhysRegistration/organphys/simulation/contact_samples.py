"""Contact samples of a body's surface, each with its area, in patches for a quick search of what a tool may touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array, as_positive
from ..points.sampling import cell_keys, one_per_cell

PATCH_CELLS = 6  # sample spacings along the edge of a patch's cell
FINER, CELL = 0.6, 0.75  # triangle edges and thinning cells in sample spacings


@dataclass(frozen=True)
class ContactSamples:
    """Surface at rest, m: vertices (Nv, 3) and faces (Nf, 3), outward; points (S, 3) with areas (S,) m^2 on it.

    The points are sorted by patch; starts (P + 1,): patch k holds the points starts[k] to starts[k + 1]; middle (P,):
    its central point; reach (P,) m: radius round that; ``spacing`` m: as asked for.
    """

    vertices: Array
    faces: NDArray[np.int64]
    points: Array
    areas: Array
    starts: NDArray[np.int64]
    middle: NDArray[np.int64]
    reach: Array
    spacing: float

    def of_patches(self, patches: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices of all points of the patches, ascending."""
        ranges = [np.arange(self.starts[k], self.starts[k + 1]) for k in patches]
        return np.concatenate(ranges) if ranges else np.zeros(0, dtype=np.int64)


def contact_samples(vertices: Array, faces: NDArray[np.int64], spacing: float) -> ContactSamples:
    """Samples no farther apart than about ``spacing`` m: every surface point has one within that distance.

    They are centroids of the triangles cut into small ones, thinned; each takes the area of those it stands for.
    """
    as_positive(spacing, "sample spacing")
    points, areas = _thinned(*triangle_centroids(vertices, faces, FINER * spacing), CELL * spacing)
    keys = cell_keys(points, PATCH_CELLS * spacing)
    order = np.argsort(keys, kind="stable")
    points, areas, keys = points[order], areas[order], keys[order]
    starts = np.concatenate([[0], np.flatnonzero(np.diff(keys)) + 1, [len(keys)]])
    return ContactSamples(vertices, faces, points, areas, starts, *_patches(points, starts), spacing)


def triangle_centroids(vertices: Array, faces: NDArray[np.int64], spacing: float) -> tuple[Array, Array]:
    """Centroids (S, 3) and areas (S,) of the triangles cut into n^2 equal ones with edges up to ``spacing``."""
    corners = vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(1)
    parts = np.maximum(np.ceil(longest / spacing), 1).astype(np.int64)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    points, areas = [], []
    for n in np.unique(parts):
        i, j = (k.ravel() for k in np.mgrid[:n, :n])
        up, down = i + j < n, i + j < n - 1  # triangles that point as the whole one, and those between them
        a = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / n
        b = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / n
        chosen = corners[parts == n]
        points.append(np.einsum("kj,njd->nkd", np.stack([1 - a - b, a, b], axis=1), chosen).reshape(-1, 3))
        areas.append(np.repeat(area[parts == n] / n**2, n * n))
    return np.concatenate(points), np.concatenate(areas)


def _thinned(points: Array, areas: Array, cell: float) -> tuple[Array, Array]:
    """One point per cubic cell of edge ``cell``, with the areas of all points nearest to it."""
    kept = points[one_per_cell(points, cell)]
    nearest = cKDTree(kept).query(points)[1]
    return kept, np.bincount(nearest, areas, len(kept)).astype(np.float64)


def _patches(points: Array, starts: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """Central sample (P,) and reach (P,) of every run of samples."""
    counts = np.diff(starts)
    owner = np.repeat(np.arange(len(counts)), counts)
    centre = np.add.reduceat(points, starts[:-1], axis=0) / counts[:, None]
    order = np.lexsort((((points - centre[owner]) ** 2).sum(1), owner))
    middle = order[starts[:-1]]
    away = np.sqrt(((points - points[middle][owner]) ** 2).sum(1))
    return middle, np.maximum.reduceat(away, starts[:-1])
