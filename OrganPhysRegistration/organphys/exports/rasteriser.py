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
    """What is seen at every pixel (h, w): depth, inf where nothing is drawn; index of the triangle or dot, else -1.

    b, c: barycentric weights of the triangle's second and third corner there.
    """

    depth: Reals
    index: NDArray[np.int32]
    b: Reals
    c: Reals

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(h, w) bool: where something is drawn."""
        return self.index >= 0

    @classmethod
    def empty(cls, view: View) -> Fragments:
        shape = (view.height, view.width)
        numbers = (np.full(shape, fill, dtype=np.float32) for fill in (np.inf, 0, 0))
        depth, b, c = numbers
        return cls(depth, np.full(shape, -1, dtype=np.int32), b, c)

    def interpolated(self, faces: NDArray[np.int64], values: Array) -> Reals:
        """Vertex values (Nv, C) at the covered pixels in row order: (number covered, C)."""
        seen = np.flatnonzero(self.covered)
        triangle, values = faces[self.index.ravel()[seen]], values.astype(np.float32)
        b, c = self.b.ravel()[seen, None], self.c.ravel()[seen, None]
        first = values[triangle[:, 0]]
        return first + b * (values[triangle[:, 1]] - first) + c * (values[triangle[:, 2]] - first)

    def keep_nearest(
        self, pixel: NDArray[np.int64], depth: Reals, index: NDArray[np.int64], b: Reals | None, c: Reals | None
    ) -> None:
        """Draw into this buffer: fragments (K,) at flat pixel positions, the nearest of each pixel stays."""
        buffer = self.depth.reshape(-1)
        np.minimum.at(buffer, pixel, depth)
        first = np.flatnonzero(depth <= buffer[pixel])
        at = pixel[first]
        self.index.reshape(-1)[at] = index[first]
        if b is not None and c is not None:
            self.b.reshape(-1)[at], self.c.reshape(-1)[at] = b[first], c[first]


def draw_triangles(view: View, vertices: Array, faces: NDArray[np.int64]) -> Fragments:
    """Nearest of the triangles facing the camera (counter-clockwise seen from it) at every pixel centre."""
    corners = view.project(vertices)[faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    low = np.maximum(np.ceil(corners[..., :2].min(1) - 0.5), 0)
    high = np.minimum(np.floor(corners[..., :2].max(1) - 0.5), [view.width - 1, view.height - 1])
    visible = np.flatnonzero((area < -1e-6) & (high >= low).all(1))  # picture y points down: the sign is turned
    size = (high - low).max(1)[visible].astype(np.int64) + 1
    classes = np.where(size <= 12, size, 1 << np.ceil(np.log2(size)).astype(np.int64))
    fragments = Fragments.empty(view)
    for side in np.unique(classes):
        group = visible[classes == side]
        step = max(1, CANDIDATES // int(side) ** 2)
        for start in range(0, len(group), step):
            rows = group[start : start + step]
            _fill(view, corners[rows], low[rows], int(side), rows, fragments)
    return fragments


def _fill(view: View, corners: Array, low: Array, side: int, names: NDArray[np.int64], fragments: Fragments) -> None:
    """Draw the triangles (T, 3, 3): the side x side pixels from the corner ``low`` (T, 2) of each are tested."""
    at_low, along_x, along_y = _weight_planes(corners, low + 0.5)
    steps = np.arange(side, dtype=np.float32)
    b, c = (
        (at_low[k][:, None] + along_y[k][:, None] * steps)[:, :, None] + (along_x[k][:, None] * steps)[:, None, :]
        for k in (0, 1)
    )
    inside = (b >= 0) & (c >= 0)
    inside &= b + c <= 1
    found = np.flatnonzero(inside)
    row, line, column = np.unravel_index(found, inside.shape)
    x, y = low[row, 0].astype(np.int64) + column, low[row, 1].astype(np.int64) + line
    on = np.flatnonzero((x < view.width) & (y < view.height))
    row, b, c = row[on], b.ravel()[found[on]], c.ravel()[found[on]]
    z = corners[:, :, 2].astype(np.float32)
    depth = z[row, 0] * (1 - b - c) + z[row, 1] * b + z[row, 2] * c
    fragments.keep_nearest(y[on] * view.width + x[on], depth, names[row], b, c)


def _weight_planes(corners: Array, start: Array) -> tuple[Reals, Reals, Reals]:
    """Barycentric weights b, c (2, T) at the pixel positions ``start`` (T, 2), and their steps along x and y (2, T)."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    scale = 1 / (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    along_x = np.stack([ac[:, 1], -ab[:, 1]]) * scale
    along_y = np.stack([-ac[:, 0], ab[:, 0]]) * scale
    at_start = along_x * (start[:, 0] - a[:, 0]) + along_y * (start[:, 1] - a[:, 1])
    return at_start.astype(np.float32), along_x.astype(np.float32), along_y.astype(np.float32)


def draw_dots(view: View, points: Array, radius: float) -> Fragments:
    """Diamonds of ``radius`` scene units round the points (N, 3), 1 to 13 pixels across, the nearest in front."""
    picture = view.project(points)
    seen = np.isfinite(picture[:, 2])
    xy = np.floor(np.where(seen[:, None], picture[:, :2], -1)).astype(np.int64)
    seen &= (xy >= 0).all(1) & (xy < [view.width, view.height]).all(1)
    names = np.flatnonzero(seen)
    fragments = Fragments.empty(view)
    if not len(names):
        return fragments
    z = picture[names, 2].astype(np.float32)
    fragments.keep_nearest(xy[names, 1] * view.width + xy[names, 0], z, names, None, None)
    left, step = min(6, round(view.focal * radius / float(np.median(z)))), 1
    while left > 0:
        fragments = _grown(fragments, min(step, left))
        left, step = left - step, step + 1
    return fragments


def _grown(fragments: Fragments, step: int) -> Fragments:
    """Every dot copied ``step`` pixels to the four sides, nearer dots over farther ones."""
    depth, index = fragments.depth.copy(), fragments.index.copy()
    whole, after, before = slice(None), slice(step, None), slice(None, -step)
    for to, source in (
        ((whole, after), (whole, before)),
        ((whole, before), (whole, after)),
        ((after, whole), (before, whole)),
        ((before, whole), (after, whole)),
    ):
        nearer = fragments.depth[source] < depth[to]
        np.copyto(depth[to], fragments.depth[source], where=nearer)
        np.copyto(index[to], fragments.index[source], where=nearer)
    return Fragments(depth, index, fragments.b, fragments.c)
