"""The sample organ: a smooth implicit shape with lobes and a fissure, like a liver. All lengths in mm, RAS.

It is asymmetric in every direction, so its pose is unique; it is built from a formula and belongs to nobody.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array

CENTRE = np.array([48.0, 12.0, 236.0])  # where the organ lies in the scanner
LABELS = {"liver": 5, "gallbladder": 4}  # as TotalSegmentator numbers them
REACH = np.array([[-145.0, -85.0, -125.0], [125.0, 80.0, 95.0]])  # box round the organ, relative to CENTRE

# centre and radii of the ellipsoids that are joined, and of those that are cut out
_LOBES = np.array(
    [
        [[35, -5, 0], [62, 55, 60]],  # right lobe
        [[32, -10, 38], [48, 44, 34]],  # dome
        [[-42, 14, 20], [58, 30, 29]],  # left lobe
        [[-92, 20, 30], [30, 17, 14]],  # its tip
        [[62, -8, -58], [27, 27, 42]],  # lower tip of the right lobe
        [[2, -36, 14], [22, 18, 26]],  # caudate lobe
    ],
    dtype=np.float64,
)
_CUTS = np.array(
    [
        [[-14, 46, -16], [6, 46, 34]],  # fissure between the lobes
        [[16, 40, -50], [15, 24, 27]],  # bed of the gallbladder
        [[4, -64, 22], [14, 15, 70]],  # groove of the great vein behind
    ],
    dtype=np.float64,
)
_GALLBLADDER = np.array([[[16, 38, -52], [12, 20, 23]]], dtype=np.float64)
_BLEND = 6.0  # width over which the parts flow into each other
_BLOCK = 16384  # points at a time: the work stays in the cache


def _ellipsoids(columns: Array, parts: Array) -> Array:
    """Smooth union of ellipsoids (K, 2, 3) at local points (3, N): about the signed distance (N,), negative inside."""
    reach = np.empty((len(parts), columns.shape[1]))
    for row, (centre, radii) in zip(reach, parts, strict=True):
        scaled = (columns - centre[:, None]) / radii[:, None]
        row[:] = (np.sqrt((scaled * scaled).sum(0)) - 1) * radii.min()
    nearest = reach.min(0)
    union: Array = nearest - _BLEND * np.log(np.exp((nearest - reach) / _BLEND).sum(0))
    return union


def level(points: Array) -> Array:
    """Implicit function (N,) of the organ at points (N, 3) RAS mm: below 0 inside, roughly a distance in mm."""
    values = np.empty(len(points))
    for start in range(0, len(points), _BLOCK):
        local = np.ascontiguousarray((points[start : start + _BLOCK] - CENTRE).T)
        solid, cut = _ellipsoids(local, _LOBES), -_ellipsoids(local, _CUTS)
        width = _BLEND / 2  # smooth maximum: the fissure keeps a rounded rim
        values[start : start + _BLOCK] = np.logaddexp(solid / width, cut / width) * width
    return values


def gradient(points: Array, *, step: float = 0.05) -> Array:
    """Gradient (N, 3) of ``level`` by central differences; it points outwards."""
    columns = [level(points + step * axis) - level(points - step * axis) for axis in np.eye(3)]
    return np.stack(columns, axis=1) / (2 * step)


def outward(points: Array) -> Array:
    """Unit outward normals (N, 3) at points (N, 3) on the surface."""
    slope = gradient(points)
    return slope / np.linalg.norm(slope, axis=1, keepdims=True)


def onto_surface(points: Array, slope: Array | None = None, *, rounds: int = 4) -> Array:
    """Points (N, 3) near the surface moved onto it along the gradient ``slope`` (N, 3) (chord method)."""
    slope = gradient(points) if slope is None else slope
    along = slope / np.einsum("ij,ij->i", slope, slope)[:, None]
    for _ in range(rounds):
        points = points - along * level(points)[:, None]
    return points


def surface_points(count: int, rng: np.random.Generator) -> Array:
    """Points (count, 3) RAS mm on the surface, uniform by area.

    Uniform points of a thin shell, projected: the shell is equally thick everywhere, so the density is that of
    the area. Only grid cells near the surface are filled.
    """
    cell, half_shell = 4.0, 1.0
    grid = box_grid(cell)
    grid = grid[np.abs(level(grid)) < cell]  # the slope is at most about 1, half a cell's diagonal 0.87 cells
    found: list[Array] = []
    while sum(map(len, found)) < count:
        near = grid[rng.integers(len(grid), size=2 * count)] + rng.uniform(-cell / 2, cell / 2, (2 * count, 3))
        height = level(near)
        near, height = near[np.abs(height) < 1.2 * half_shell], height[np.abs(height) < 1.2 * half_shell]
        slope = gradient(near)
        shell = np.abs(height) < half_shell * np.linalg.norm(slope, axis=1)
        found.append(onto_surface(near[shell], slope[shell]))
    return np.concatenate(found)[:count]


def interior_points(count: int, rng: np.random.Generator) -> Array:
    """Points (count, 3) RAS mm inside the organ, uniform by volume."""
    found: list[Array] = []
    while sum(map(len, found)) < count:
        trial = CENTRE + rng.uniform(REACH[0], REACH[1], size=(4 * count, 3))
        found.append(trial[level(trial) < 0])
    return np.concatenate(found)[:count]


def box_grid(cell: float) -> Array:
    """Centres (N, 3) RAS mm of the cubic cells of edge ``cell`` that fill the box round the organ."""
    axes = [np.arange(low + cell / 2, high, cell) for low, high in REACH.T]
    return CENTRE + np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def labels_at(points: Array) -> NDArray[np.uint8]:
    """Label (N,) of points (N, 3) RAS mm: 5 liver, 4 gallbladder, 0 nothing."""
    labels = np.zeros(len(points), dtype=np.uint8)
    labels[_ellipsoids((points - CENTRE).T, _GALLBLADDER) < 0] = LABELS["gallbladder"]
    labels[level(points) < 0] = LABELS["liver"]
    return labels
