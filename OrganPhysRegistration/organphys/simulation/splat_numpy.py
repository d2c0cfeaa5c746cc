"""Gaussians moved by the motion at the nodes of a grid, in numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..ground.checks import Array
from .simulation_basis import LocalColumns
from .splat_binding import Followers, local_motion, sandwiched
from .splat_grid import Single, SplatGrid
from .splat_threads import in_threads

Use = Callable[[slice, Single, Single], None]
CHUNK = 8192  # Gaussians at a time: few calls, and their rows stay in the cache


@dataclass(frozen=True)
class NumpyMover:
    """covariance (K, 3, 3) at rest in squared scene units."""

    bound: Followers
    grid: SplatGrid
    covariance: Single

    def frame(self, base: Array, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and covariances (K, 3, 3) at base coordinates (n, 3)."""
        moved = np.empty((3, len(self.bound.index)), dtype=np.float32)
        shape = np.empty((3, 3, len(self.bound.index)), dtype=np.float32)

        def use(part: slice, u: Single, f: Single) -> None:
            moved[:, part] = u
            sandwiched(f, self._planar[:, :, part], shape[:, :, part])

        self._each(base, local, z, use)
        return moved.T, shape.transpose(2, 0, 1)

    def motion(self, base: Array, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients (K, 3, 3)."""
        moved = np.empty((3, len(self.bound.index)), dtype=np.float32)
        gradient = np.empty((3, 3, len(self.bound.index)), dtype=np.float32)

        def use(part: slice, u: Single, f: Single) -> None:
            moved[:, part], gradient[:, :, part] = u, f

        self._each(base, local, z, use)
        return moved.T, gradient.transpose(2, 0, 1)

    def _each(self, base: Array, local: LocalColumns | None, z: Array, use: Use) -> None:
        """Calls ``use`` with each chunk of Gaussians, their displacement (3, k) in scene units and F (3, 3, k)."""
        fields = self.grid.fields(base, in_threads)
        extra = None if local is None else self._extra(local, z)

        def move(k: int) -> None:
            part = slice(k * CHUNK, (k + 1) * CHUNK)
            body = np.ascontiguousarray((self._weights[k] @ fields).T)
            if extra is not None:
                body += extra[:, part]
            use(part, *self._shared(k, part, body))

        in_threads(move, len(self._weights))

    def _shared(self, k: int, part: slice, body: Single) -> tuple[Single, Single]:
        """u b and I + b (F - I) + u (grad b)^T from the body's motion (12, k)."""
        u, f = body[:3], body[3:].reshape(3, 3, -1).transpose(1, 0, 2)
        if self._fading[k]:
            share, slope = self._shares[0, part], self._shares[1:, part]
            f *= share
            f += u[:, None] * slope
            u *= share
        f[[0, 1, 2], [0, 1, 2]] += 1.0
        u /= np.float32(self.bound.unit)
        return u, f

    def _extra(self, local: LocalColumns, z: Array) -> Single:
        """What local functions add (12, K), in the order of the nodes' motion."""
        near, extra, slopes = local_motion(local, z, self.bound.points)
        out = np.zeros((12, len(self.bound.index)), dtype=np.float32)
        out[:3, near] = extra.T
        out[3:, near] = slopes.transpose(2, 1, 0).reshape(9, -1)
        return out

    @cached_property
    def _weights(self) -> list[csr_array]:
        starts = range(0, len(self.bound.index), CHUNK)
        return [self.grid.weights(slice(start, start + CHUNK)) for start in starts]

    @cached_property
    def _fading(self) -> list[bool]:
        """Whether some Gaussian of the chunk follows by less than its full motion."""
        starts = range(0, len(self.bound.index), CHUNK)
        return [bool(self.bound.share_slope[start : start + CHUNK].any()) for start in starts]

    @cached_property
    def _shares(self) -> Single:
        return np.concatenate([self.bound.share[None], self.bound.share_slope.T]).astype(np.float32)

    @cached_property
    def _planar(self) -> Single:
        return np.ascontiguousarray(self.covariance.transpose(1, 2, 0))
