"""Closed triangle surfaces that the instrument is put together from: lofts through rings of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array

Solid = tuple[Array, NDArray[np.int64]]  # vertices (N, 3) m, triangles (M, 3) counter-clockwise from outside
AXES = {"x": [1, 2, 0], "y": [2, 0, 1], "z": [0, 1, 2]}  # two across and one along, a right-handed triple


def lofted(rings: Array) -> Solid:
    """Surface through rings (K, n, 3), closed at both ends by fans, which want each end's ring nearly convex."""
    count, around = rings.shape[:2]
    ends = np.stack([rings[0].mean(0), rings[-1].mean(0)])
    vertices = np.concatenate([rings.reshape(-1, 3), ends])
    i, j = (k.ravel() for k in np.mgrid[: count - 1, :around])
    a, b = i * around + j, i * around + (j + 1) % around
    side = np.concatenate([np.stack([a, b, b + around], 1), np.stack([a, b + around, a + around], 1)])
    j = np.arange(around)
    k = (j + 1) % around
    first, last = count * around, (count - 1) * around
    low = np.stack([np.full(around, first), k, j], 1)
    high = np.stack([np.full(around, first + 1), last + j, last + k], 1)
    return outward(vertices, np.concatenate([side, low, high]))


def outward(vertices: Array, triangles: NDArray[np.int64]) -> Solid:
    """The closed surface with its triangles the right way round."""
    return vertices, (triangles if signed_volume(vertices, triangles) > 0 else triangles[:, ::-1])


def signed_volume(vertices: Array, triangles: NDArray[np.int64]) -> float:
    """Enclosed volume, m^3, by the divergence theorem; negative where triangles look inwards."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def joined(*solids: Solid) -> Solid:
    """Several solids as one set of triangles."""
    starts = np.cumsum([0, *(len(v) for v, _ in solids[:-1])])
    triangles = [t + start for (_, t), start in zip(solids, starts, strict=True)]
    return np.concatenate([v for v, _ in solids]), np.concatenate(triangles)


def extruded(outline: Array, axis: str, low: float, high: float, bevel: float) -> Solid:
    """Plate with the convex outline (n, 2) m, from low to high m along an axis, its edges broken by ``bevel`` m."""
    middle = outline.mean(0)
    size = np.sqrt(((outline - middle) ** 2).sum(1)).max()
    shrunk = middle + (1 - bevel / size) * (outline - middle)
    levels = ((shrunk, low), (outline, low + bevel), (outline, high - bevel), (shrunk, high))
    rings = np.stack([np.column_stack([ring, np.full(len(ring), at)]) for ring, at in levels])
    return lofted(_along(rings, axis))


def circle(radius: float, around: int = 24) -> Array:
    """Outline (n, 2)."""
    angle = 2 * np.pi * np.arange(around) / around
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def rod(axis: str, profile: list[tuple[float, float]], around: int = 24) -> Solid:
    """Body of revolution about an axis; profile: (place along it, radius) in m."""
    ring = circle(1.0, around)
    rings = np.stack([np.column_stack([radius * ring, np.full(around, at)]) for at, radius in profile])
    return lofted(_along(rings, axis))


def torus(radius: float, tube: float, around: int = 32, across: int = 8) -> Solid:
    """Ring about z."""
    u, v = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across, indexing="ij")
    away = radius + tube * np.cos(v)
    vertices = np.stack([away * np.cos(u), away * np.sin(u), tube * np.sin(v)], -1).reshape(-1, 3)
    i, j = (k.ravel() for k in np.mgrid[:around, :across])
    a, b = i * across + j, i * across + (j + 1) % across
    c, d = (i + 1) % around * across + j, (i + 1) % around * across + (j + 1) % across
    return outward(vertices, np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)]))


def _along(rings: Array, axis: str) -> Array:
    """Rings given as (across, across, along), put along the named axis."""
    out = np.empty_like(rings)
    out[..., AXES[axis]] = rings
    return out
