"""Shapes of tool parts: signed gap and outward normal at points of the part's own frame, in metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..asset.grid_distance import grid_distance
from ..asset.grid_spline import GridSpline
from ..asset.surface_distance import SurfaceDistance
from ..ground.checks import Array, InputError, as_points, as_positive, as_vector


class Shape(Protocol):
    """A solid with a smallest ``radius`` of curvature (m), which bounds how far it may move in one step."""

    @property
    def radius(self) -> float:
        """Thinnest part, m."""

    @property
    def extent(self) -> float:
        """Distance of its farthest point from the origin of the frame, m."""

    def gap_and_normal(self, points: Array) -> tuple[Array, Array]:
        """Signed distance (N,) of points (N, 3), negative inside, and its gradient (N, 3), of unit length."""

    def bend(self, points: Array) -> Array:
        """Second derivative (N, 3, 3) of the distance, 1/m."""


@dataclass(frozen=True)
class Capsule:
    """All points within ``radius`` m of the segment from ``start`` to ``end`` (3,); a sphere if they coincide."""

    start: Array
    end: Array
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", as_vector(self.start, "capsule start"))
        object.__setattr__(self, "end", as_vector(self.end, "capsule end"))
        as_positive(self.radius, "capsule radius")

    @property
    def extent(self) -> float:
        return float(max(np.linalg.norm(self.start), np.linalg.norm(self.end)) + self.radius)

    def gap_and_normal(self, points: Array) -> tuple[Array, Array]:
        distance, normal, _ = self._from_axis(points)
        return distance - self.radius, normal

    def bend(self, points: Array) -> Array:
        distance, normal, beside = self._from_axis(points)
        axis = (self.end - self.start) / max(float(np.linalg.norm(self.end - self.start)), 1e-30)
        flat = np.eye(3) - normal[:, :, None] * normal[:, None, :] - beside[:, None, None] * np.outer(axis, axis)
        return flat / np.maximum(distance, 1e-12)[:, None, None]

    def _from_axis(self, points: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Distance (N,) from the segment, unit direction (N, 3), and whether its foot is between the ends (N,)."""
        axis = self.end - self.start
        offset = points - self.start
        along = offset @ (axis / max(float(axis @ axis), 1e-30))
        offset -= np.minimum(np.maximum(along, 0.0), 1.0)[:, None] * axis
        distance = np.sqrt(np.einsum("na,na->n", offset, offset))
        offset /= np.maximum(distance, 1e-12)[:, None]
        return distance, offset, (along > 0) & (along < 1)


def sphere(radius: float, centre: Array | None = None) -> Capsule:
    """A ball of ``radius`` m round ``centre`` (3,), the origin of the tool's frame if not given."""
    at = np.zeros(3) if centre is None else centre
    return Capsule(at, at, radius)


@dataclass(frozen=True)
class GridShape:
    """A solid given by its signed distance on a grid; beyond the grid it is as far as the grid's border says."""

    distance: GridSpline
    radius: float
    extent: float

    def gap_and_normal(self, points: Array) -> tuple[Array, Array]:
        values, gradients = self.distance.values_and_gradients(points)
        normal = gradients[:, 0]
        return values[:, 0], normal / np.maximum(np.sqrt((normal**2).sum(1)), 1e-12)[:, None]

    def bend(self, points: Array) -> Array:
        """Zero: the bend of a tabulated distance is left out, which costs iterations, not accuracy."""
        return np.zeros((len(points), 3, 3))


def surface_shape(vertices: Array, faces: NDArray[np.int64], radius: float, *, spacing: float = 5e-4) -> GridShape:
    """Solid inside a closed surface, vertices (Nv, 3) m, faces (Nf, 3) outward, sampled every ``spacing`` m.

    ``radius`` m: its thinnest part, see ``Shape``. InputError for a grid of more than 20 million nodes.
    """
    vertices = as_points(vertices, "tool vertices")
    spacing, margin = as_positive(spacing, "spacing"), 6 * spacing
    low = vertices.min(0) - margin
    counts = np.ceil((vertices.max(0) + margin - low) / spacing).astype(np.int64) + 1
    if counts.prod() > 20_000_000:
        raise InputError(f"spacing: {spacing:g} m needs {counts.prod()} grid nodes for this tool, use a coarser one")
    nodes = low + spacing * np.stack(np.meshgrid(*(np.arange(k) for k in counts), indexing="ij"), -1)
    distance = grid_distance(nodes, SurfaceDistance(vertices, np.asarray(faces, dtype=np.int64)), spacing)
    coefficients = ndimage.spline_filter(distance, order=3, mode="mirror")[..., None]
    extent = float(np.sqrt((vertices**2).sum(1).max()))
    return GridShape(GridSpline(low, spacing, coefficients), as_positive(radius, "radius"), extent)
