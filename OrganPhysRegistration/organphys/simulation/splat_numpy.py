"""Gaussians moved by the motion at the nodes of a grid, in numpy."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..ground.checks import Array
from .simulation_basis import LocalColumns
from .splat_binding import Followers, local_motion, sandwiched
from .splat_grid import CHUNK, Single, SplatGrid

THREADS = min(os.cpu_count() or 1, 4)


@dataclass(frozen=True)
class NumpyMover:
    """covariance (K, 3, 3) at rest in squared scene units."""

    bound: Followers
    grid: SplatGrid
    covariance: Single

    def frame(self, fields: Single, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and covariances (K, 3, 3), by the nodes' motion (Nn, 12)."""
        moved = np.empty((12, len(self.bound.index)), dtype=np.float32)
        out = np.empty((3, 3, len(self.bound.index)), dtype=np.float32)
        extra = None if local is None else self._extra(local, z)

        def move(k: int) -> None:
            part = slice(k * CHUNK, (k + 1) * CHUNK)
            self._interpolate(k, fields, extra, moved[:, part])
            sandwiched(moved[3:, part].reshape(3, 3, -1), self._planar[:, :, part], out[:, :, part])

        self._in_chunks(move)
        return moved[:3].T, out.transpose(2, 0, 1)

    def motion(self, fields: Single, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients (K, 3, 3)."""
        moved = np.empty((12, len(self.bound.index)), dtype=np.float32)
        extra = None if local is None else self._extra(local, z)
        self._in_chunks(lambda k: self._interpolate(k, fields, extra, moved[:, k * CHUNK : (k + 1) * CHUNK]))
        return moved[:3].T, moved[3:].reshape(3, 3, -1).transpose(2, 0, 1)

    def _in_chunks(self, work: Callable[[int], None]) -> None:
        count = -(-len(self.bound.index) // CHUNK)
        if THREADS == 1 or count < 2 * THREADS:
            for k in range(count):
                work(k)
            return
        with ThreadPoolExecutor(THREADS) as pool:
            list(pool.map(work, range(count)))

    def _interpolate(self, k: int, fields: Single, extra: Single | None, out: Single) -> None:
        """Displacement in scene units and F, (12, k) with the Gaussians last: u_a, then F_am in the order a, m."""
        part = slice(k * CHUNK, (k + 1) * CHUNK)
        body = (self._weights[k] @ fields).T
        if extra is not None:
            body = body + extra[:, part]
        share, slope = self._shares[0, part], self._shares[1:, part]
        for a in range(3):
            for m in range(3):
                row = out[3 + 3 * a + m]
                np.multiply(body[3 + 3 * m + a], share, out=row)
                row += body[a] * slope[m]
            out[3 + 4 * a] += 1.0
            np.multiply(body[a], share, out=out[a])
        out[:3] /= np.float32(self.bound.unit)

    def _extra(self, local: LocalColumns, z: Array) -> Single:
        """What local functions add (12, K), in the order of the nodes' motion."""
        near, extra, slopes = local_motion(local, z, self.bound.points)
        out = np.zeros((12, len(self.bound.index)), dtype=np.float32)
        out[:3, near] = extra.T
        out[3:, near] = slopes.transpose(2, 1, 0).reshape(9, -1)
        return out

    @cached_property
    def _weights(self) -> list[csr_array]:
        whole = self.grid.weights()
        return [whole[start : start + CHUNK] for start in range(0, len(self.bound.index), CHUNK)]

    @cached_property
    def _shares(self) -> Single:
        return np.concatenate([self.bound.share[None], self.bound.share_slope.T]).astype(np.float32)

    @cached_property
    def _planar(self) -> Single:
        return np.ascontiguousarray(self.covariance.transpose(1, 2, 0))
