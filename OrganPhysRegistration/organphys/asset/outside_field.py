"""The deformation beside the organ: that of the nearest organ region, fading to nothing over 30 mm.

u(x) = f (b u_organ(x) + (1 - b) A(x)), all smooth in x:
  u_organ  displacement of the reduced basis, exact inside the organ and used a little way outside;
  A        a twice differentiable extension of it, an average over organ tissue whose width grows with the distance;
  f(D)     the fade, 1 at the organ and 0 at ``reach`` mm;  b(D)  hands over from u_organ to A beside the surface;
  D        a twice differentiable approximation of the signed distance to the surface.
b = f = 1 holds wherever D is at most its largest value on the organ itself, so no point inside is ever touched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..ground.checks import Array
from .fill_outwards import fill_outwards
from .grid_distance import grid_distance
from .grid_spline import GridSpline
from .surface_distance import SurfaceDistance

FADE_MM = 30.0
NODES = 300_000
COLLAR_CELLS = 1.5  # width of the hand-over beside the surface, in grid cells
KNOWN_CELLS = 2.0  # nodes up to this many cells outside take the organ's own displacement
OWN, MIXED, ZERO = 0, 1, 2  # kinds of grid cells
ROUNDING = 0.15  # part of a ramp that is rounded at either end: the steepest slope stays 1 / 0.85

Displacement = Callable[[Array], tuple[Array, Array]]
"""CT mm (N, 3) -> displacement (N, 3) in mm and its gradient (N, 3, 3), [a, m] = d u_a / d x_m."""


@dataclass(frozen=True)
class OutsideField:
    """Smooth distance and extended displacement on a grid: spline channels D, A_x, A_y, A_z in mm.

    margin: D up to which the organ's own displacement holds; collar: width of the hand-over; reach: end of the fade.
    """

    spline: GridSpline
    margin: float
    collar: float
    reach: float

    def split(self, points: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows of the points (N, 3) where the organ's own displacement holds alone, and where the spline is needed.

        In neither: rows where the displacement is zero.
        """
        cell = np.floor((points - self.spline.origin) / self.spline.spacing).astype(np.int64)
        shape = np.array(self._kind.shape)
        within = ((cell >= 0) & (cell < shape)).all(1)
        kind = np.where(within, self._kind[tuple(np.clip(cell, 0, shape - 1).T)], ZERO)
        return np.flatnonzero(kind == OWN), np.flatnonzero(kind == MIXED)

    @cached_property
    def _kind(self) -> NDArray[np.int8]:
        """(nx, ny, nz): what holds in the whole cell above each node; a spline lies within its coefficients' range."""
        distance = self.spline.coefficients[..., 0]
        window = {"size": 4, "origin": (-1, -1, -1), "mode": "nearest"}
        kind = np.full(distance.shape, MIXED, dtype=np.int8)
        kind[ndimage.maximum_filter(distance, **window) <= self.margin] = OWN
        kind[ndimage.minimum_filter(distance, **window) >= self.reach] = ZERO
        return kind

    def inner(self, distance: Array) -> tuple[Array, Array]:
        """Share b (N,) of the organ's own displacement at smooth distance D (N,), and db/dD."""
        return _falling(distance, self.margin, self.margin + self.collar)

    def fade(self, distance: Array) -> tuple[Array, Array]:
        """Fade f (N,) at smooth distance D (N,), and df/dD."""
        return _falling(distance, self.margin, self.reach)


def build_outside_field(surface: SurfaceDistance, displacement: Displacement) -> OutsideField:
    """Field round ``surface`` for an organ that moves by ``displacement``."""
    at_surface = displacement(surface.vertices[:: max(1, len(surface.vertices) // 4000)])[0]
    reach = max(FADE_MM, 1.5 * float(np.linalg.norm(at_surface, axis=1).max()))  # a steeper fade could fold
    low, high = surface.vertices.min(0) - reach, surface.vertices.max(0) + reach
    spacing = float((np.prod(high - low) / NODES) ** (1 / 3))
    low, high = low - 3 * spacing, high + 3 * spacing
    axes = [np.arange(low[k], high[k] + spacing, spacing) for k in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    distance = grid_distance(nodes, surface, spacing)
    extension = _extend(nodes, distance <= KNOWN_CELLS * spacing, surface, displacement, spacing)
    spline = GridSpline(low, spacing, np.concatenate([distance[..., None], extension], axis=-1))
    margin = _largest_distance(spline, surface.vertices)
    return OutsideField(spline, max(margin, 0.0), COLLAR_CELLS * spacing, reach)


def _extend(
    nodes: Array, inside: NDArray[np.bool_], surface: SurfaceDistance, displacement: Displacement, spacing: float
) -> Array:
    """Displacement (nx, ny, nz, 3) at all nodes, from the affine motion u + G (x - x0) of the tissue nearby."""
    shape, low, centre = nodes.shape[:3], nodes[0, 0, 0], surface.vertices.mean(0)
    cell = np.rint((surface.vertices - low) / spacing).astype(np.int64)
    flat = np.ravel_multi_index(tuple(cell.T), shape)
    beside, vertex = np.unique(flat, return_index=True)  # thin parts hold no node: their vertices speak for them
    keep = ~inside.ravel()[beside]
    index = np.concatenate([np.flatnonzero(inside), beside[keep]])
    places = np.concatenate([nodes[inside], surface.vertices[vertex[keep]]])
    u, gradient = displacement(places)
    affine = np.zeros((*shape, 12), dtype=np.float32)  # right to 1e-5 mm; half the memory to move about
    rows = affine.reshape(-1, 12)
    rows[index, :3] = u - np.einsum("nam,nm->na", gradient, places - centre)
    rows[index, 3:] = gradient.reshape(-1, 9)
    known = np.zeros(shape, dtype=bool)
    known.ravel()[index] = True
    filled = fill_outwards(affine, known)
    return filled[..., :3] + np.einsum("xyzam,xyzm->xyza", filled[..., 3:].reshape(*shape, 3, 3), nodes - centre)


def _largest_distance(spline: GridSpline, points: Array, chunk: int = 16384) -> float:
    starts = range(0, len(points), chunk)
    return max((float(spline.values(points[i : i + chunk])[:, 0].max()) for i in starts), default=0.0)


def _falling(x: Array, start: float, end: float) -> tuple[Array, Array]:
    """1 up to ``start``, 0 from ``end``, continuously differentiable between; and its derivative."""
    t = np.clip((x - start) / (end - start), 0.0, 1.0)
    r = ROUNDING
    slope = np.minimum(np.minimum(t, 1 - t) / r, 1.0) / (1 - r)
    rise = np.where(t < r, t**2 / (2 * r * (1 - r)), (t - r / 2) / (1 - r))
    rise = np.where(t > 1 - r, 1 - (1 - t) ** 2 / (2 * r * (1 - r)), rise)
    return 1 - rise, -slope / (end - start)
