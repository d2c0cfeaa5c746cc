"""A small software rasteriser on numpy: depth-buffered triangles and dots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .camera_view import View

Reals = NDArray[np.floating]  # single precision where there are many
CANDIDATES = 1_000_000  # pixel tests at once: bounds the memory to some 100 MB


@dataclass(frozen=True)
class Fragments:
    """depth (h, w), inf where nothing is drawn, and index (h, w) of the triangle or dot seen there, else -1."""

    depth: Reals
    index: NDArray[np.int64]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(h, w) bool: where something is drawn."""
        return self.index >= 0


def draw_triangles(view: View, vertices: Array, faces: NDArray[np.int64]) -> Fragments:
    """Nearest of the triangles facing the camera (counter-clockwise seen from it) at every pixel centre."""
    corners = view.project(vertices).astype(np.float32)[faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    low = np.ceil(corners[..., :2].min(1) - 0.5)
    high = np.floor(corners[..., :2].max(1) - 0.5)
    on_picture = (high >= 0).all(1) & (low < [view.width, view.height]).all(1) & (high >= low).all(1)
    visible = np.flatnonzero((area < 0) & on_picture)  # picture y points down: the sign is turned
    low, size = low[visible], (high - low).max(1)[visible].astype(np.int64) + 1
    depth = np.full(view.width * view.height, np.inf, dtype=np.float32)
    index = np.full(view.width * view.height, -1)
    classes = np.where(size <= 12, size, 1 << np.ceil(np.log2(size)).astype(np.int64))
    for side in np.unique(classes):
        group = np.flatnonzero(classes == side)
        step = max(1, CANDIDATES // int(side) ** 2)
        for start in range(0, len(group), step):
            rows = group[start : start + step]
            _fill(view, corners[visible[rows]], visible[rows], low[rows], int(side), depth, index)
    return Fragments(depth.reshape(view.height, view.width), index.reshape(view.height, view.width))


def _fill(
    view: View,
    corners: Reals,
    names: NDArray[np.int64],
    low: Reals,
    side: int,
    depth: Reals,
    index: NDArray[np.int64],
) -> None:
    """Test the side x side pixels from ``low`` of every triangle and keep the nearest in depth and index (flat)."""
    x = low[:, 0, None] + np.tile(np.arange(side, dtype=np.float32), side)
    y = low[:, 1, None] + np.repeat(np.arange(side, dtype=np.float32), side)
    v, w = _barycentric(corners, x + np.float32(0.5), y + np.float32(0.5))
    row, slot = np.nonzero((v >= 0) & (w >= 0) & (v + w <= 1))
    column, line = x[row, slot].astype(np.int64), y[row, slot].astype(np.int64)
    v, w = v[row, slot], w[row, slot]
    z = corners[row, 0, 2] * (1 - v - w) + corners[row, 1, 2] * v + corners[row, 2, 2] * w
    on = (column >= 0) & (line >= 0) & (column < view.width) & (line < view.height)
    _keep_nearest(line[on] * view.width + column[on], z[on], names[row[on]], depth, index)


def _barycentric(corners: Reals, x: Reals, y: Reals) -> tuple[Reals, Reals]:
    """Coordinates v, w of the second and third corner for pixel positions x, y (T, K) of triangles (T, 3, 3)."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    scale = 1 / (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    dx, dy = x - a[:, 0, None], y - a[:, 1, None]
    v = (dx * ac[:, 1, None] - dy * ac[:, 0, None]) * scale[:, None]
    w = (dy * ab[:, 0, None] - dx * ab[:, 1, None]) * scale[:, None]
    return v, w


def interpolate(view: View, fragments: Fragments, vertices: Array, faces: NDArray[np.int64], values: Reals) -> Reals:
    """Vertex values (Nv, C) at the covered pixels, in row order: (number covered, C)."""
    y, x = np.nonzero(fragments.covered)
    triangle = faces[fragments.index[y, x]]
    corners = view.project(vertices).astype(np.float32)[triangle]
    centre = (x[:, None] + 0.5).astype(np.float32), (y[:, None] + 0.5).astype(np.float32)
    v, w = _barycentric(corners, *centre)
    values = values.astype(np.float32)
    return (1 - v - w) * values[triangle[:, 0]] + v * values[triangle[:, 1]] + w * values[triangle[:, 2]]


def draw_dots(view: View, points: Array, radius: float) -> Fragments:
    """Square-ish dots of ``radius`` scene units round the points (N, 3), at least one pixel, the nearest in front."""
    picture = view.project(points)
    seen = np.isfinite(picture[:, 2])
    xy = np.floor(np.where(seen[:, None], picture[:, :2], -1)).astype(np.int64)
    seen &= (xy >= 0).all(1) & (xy < [view.width, view.height]).all(1)
    names = np.flatnonzero(seen)
    depth = np.full(view.width * view.height, np.inf, dtype=np.float32)
    index = np.full(view.width * view.height, -1)
    z = picture[names, 2].astype(np.float32)
    _keep_nearest(xy[names, 1] * view.width + xy[names, 0], z, names, depth, index)
    fragments = Fragments(depth.reshape(view.height, view.width), index.reshape(view.height, view.width))
    median = float(np.median(picture[names, 2])) if len(names) else 1.0
    for _ in range(min(6, round(view.focal * radius / median))):
        fragments = _grown(fragments)
    return fragments


def _keep_nearest(
    pixel: NDArray[np.int64], z: Reals, names: NDArray[np.int64], depth: Reals, index: NDArray[np.int64]
) -> None:
    np.minimum.at(depth, pixel, z)
    first = z <= depth[pixel]
    index[pixel[first]] = names[first]


def _grown(fragments: Fragments) -> Fragments:
    """Every dot one pixel larger to the four sides, nearer dots over farther ones."""
    depth, index = fragments.depth.copy(), fragments.index.copy()
    whole, after, before = slice(None), slice(1, None), slice(None, -1)
    for to, source in (
        ((whole, after), (whole, before)),
        ((whole, before), (whole, after)),
        ((after, whole), (before, whole)),
        ((before, whole), (after, whole)),
    ):
        nearer = fragments.depth[source] < depth[to]
        depth[to] = np.where(nearer, fragments.depth[source], depth[to])
        index[to] = np.where(nearer, fragments.index[source], index[to])
    return Fragments(depth, index)
