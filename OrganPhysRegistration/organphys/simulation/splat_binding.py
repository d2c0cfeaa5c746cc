"""Gaussians bound to a body: those in it and near it move along, those farther away less and less, the rest not at all.

A Gaussian at X moves to X + b(X) u(X), with u the body's displacement, carried on beyond its surface, and b falling
smoothly from 1 to 0 across a band. Its deformation gradient has the term of the slope of b, and that of the weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError, as_positive
from ..points.gaussians import Gaussians
from .body import Body
from .gaussian_shapes import covariances
from .simulation_basis import LocalColumns

CHUNK = 4096  # Gaussians at a time: their rows stay in the cache
Single = NDArray[np.float32]


@dataclass(frozen=True)
class SplatBinding:
    """index (K,): rows of the splat that follow; points (K, 3) m at rest; share b (K,) and its slope (K, 3) per m;
    phi (K, n) and slopes (3, K, n) per m of the basis without local columns, with b in them; covariance (K, 3, 3) in
    squared scene units; ``unit``: metres per scene unit."""

    index: NDArray[np.int64]
    points: Array
    share: Array
    share_slope: Array
    phi: Single
    slopes: Single
    covariance: Single
    unit: float

    def frame(self, body: Body, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and covariances F C F^T (K, 3, 3) at Z (n, 3) of ``body``."""
        u, f = self.motion(body, z)
        out = np.empty((3, 3, len(self.index)), dtype=np.float32)
        rows, shape = f.transpose(1, 2, 0), self._planar
        for start in range(0, len(self.index), CHUNK):
            part = slice(start, start + CHUNK)
            sandwiched(rows[:, :, part], shape[:, :, part], out[:, :, part])
        return u, out.transpose(2, 0, 1)

    def motion(self, body: Body, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients F (K, 3, 3) at Z (n, 3) of ``body``.

        The body may have other local functions than when the splat was bound, but no other pins.
        """
        n, local = self.phi.shape[1], body.basis.local
        base = z[:n] if local is None else z[:n] - local.overlap @ z[n:]
        columns = np.ascontiguousarray(base.T, dtype=np.float32)
        u = np.empty((3, len(self.index)), dtype=np.float32)
        f = np.empty((3, 3, len(self.index)), dtype=np.float32)
        for start in range(0, len(self.index), CHUNK):
            part = slice(start, start + CHUNK)
            for a, column in enumerate(columns):
                np.matmul(self.phi[part], column, out=u[a, part])
                for m in range(3):
                    np.matmul(self.slopes[m, part], column, out=f[a, m, part])
        u /= np.float32(self.unit)
        f[[0, 1, 2], [0, 1, 2]] += 1.0
        moved, gradient = u.T, f.transpose(2, 0, 1)
        if local is not None:
            self._add_local(body, z[n:], moved, gradient)
        return moved, gradient

    @cached_property
    def _planar(self) -> Single:
        return np.ascontiguousarray(self.covariance.transpose(1, 2, 0))

    def _add_local(self, body: Body, z: Array, u: Single, f: Single) -> None:
        assert body.basis.local is not None
        near, extra, slopes = local_motion(body.basis.local, z, self.points)
        share = self.share[near]
        u[near] += share[:, None] * extra / self.unit
        f[near] += share[:, None, None] * slopes + extra[:, :, None] * self.share_slope[near, None, :]


def local_motion(local: LocalColumns, z: Array, points: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Which points (N, 3) m the local functions reach (k,), what they add there, (k, 3) m, and its slopes (k, 3, 3).

    z (m, 3): local coordinates; without what the local columns take from the others.
    """
    functions, weights = local.functions, local.mixing @ z
    near = np.flatnonzero(((points - functions.middle) ** 2).sum(1) < functions.reach**2)
    values, slopes = functions.values_and_gradients(points[near])
    return near, values @ weights, (slopes @ weights).transpose(1, 2, 0)


def sandwiched(f: Single, c: Single, out: Single) -> None:
    """out = F C F^T, all (3, 3, K) with the Gaussians last: several times faster than small matrix products.

    Ten calls of numpy on nine rows each, so that threads seldom wait for each other between the calls.
    """
    half, term = np.empty_like(out), np.empty_like(out)
    np.multiply(f[:, 0, None], c[None, 0], out=half)
    for m in (1, 2):
        np.multiply(f[:, m, None], c[None, m], out=term)
        half += term
    np.multiply(half[:, 0, None], f[None, :, 0], out=out)
    for m in (1, 2):
        np.multiply(half[:, m, None], f[None, :, m], out=term)
        out += term


@dataclass(frozen=True)
class Followers:
    """Gaussians that follow a body: index (K,) into the splat, points (K, 3) m at rest, share b (K,), its slope
    (K, 3) per m, and metres per scene unit."""

    index: NDArray[np.int64]
    points: Array
    share: Array
    share_slope: Array
    unit: float


def bind_splat(
    body: Body, gaussians: Gaussians, metres_per_unit: float, *, distance: float = 0.003, band: float = 0.003
) -> SplatBinding:
    """Binds all valid Gaussians up to ``distance`` + ``band`` m from the body at rest; they follow in full up to
    ``distance``. InputError if none is so near. ``splat_grid.bind_to_grid`` is the quick way for many Gaussians."""
    bound = followers(body, gaussians, metres_per_unit, distance, band)
    index, points, share, share_slope = bound.index, bound.points, bound.share, bound.share_slope
    n = (body.plain or body).basis.size
    phi, slopes = np.empty((len(index), n), dtype=np.float32), np.empty((3, len(index), n), dtype=np.float32)
    for start in range(0, len(index), CHUNK):
        part = slice(start, start + CHUNK)
        values, gradients = (body.plain or body).basis.phi_and_gradient(points[part])
        phi[part] = share[part, None] * values
        slopes[:, part] = share[part, None] * gradients + share_slope[part].T[:, :, None] * values
    covariance = covariances(gaussians, index).astype(np.float32)
    return SplatBinding(index, points, share, share_slope, phi, slopes, covariance, bound.unit)


def followers(body: Body, gaussians: Gaussians, metres_per_unit: float, distance: float, band: float) -> Followers:
    """Which Gaussians follow and by how much; arguments as for ``bind_splat``."""
    unit, band = as_positive(metres_per_unit, "metres per unit"), as_positive(band, "band")
    if not np.isfinite(distance) or distance < 0:
        raise InputError(f"distance: expected a finite number of at least 0, got {distance}")
    index = np.flatnonzero(gaussians.valid & _within_box(body, gaussians.means, unit, distance + band))
    points = gaussians.means[index].astype(np.float64) * unit
    away, foot = body.shape.surface.signed_with_foot(points)
    kept = away < distance + band
    index, points, away, foot = index[kept], points[kept], away[kept], foot[kept]
    if not len(index):
        raise InputError(f"splat: no Gaussian within {1000 * (distance + band):g} mm of the organ; is the scale right?")
    share, steepness = _fade(away, distance, band)
    outward = (points - foot) / np.maximum(away, 1e-12)[:, None]
    share_slope = np.where(away[:, None] > distance, steepness[:, None] * outward, 0.0)
    return Followers(index, points, share, share_slope, unit)


def _within_box(body: Body, means: NDArray[np.floating], unit: float, margin: float) -> NDArray[np.bool_]:
    vertices = body.samples.vertices
    low, high = (vertices.min(0) - margin) / unit, (vertices.max(0) + margin) / unit
    inside: NDArray[np.bool_] = ((means >= low) & (means <= high)).all(1)
    return inside


def _fade(away: Array, distance: float, band: float) -> tuple[Array, Array]:
    """1 up to ``distance``, 0 from ``distance`` + ``band``, twice continuous between; and its derivative."""
    t = np.clip((away - distance) / band, 0.0, 1.0)
    return 1 - t**3 * (10 - 15 * t + 6 * t**2), -30 * t**2 * (1 - t) ** 2 / band
