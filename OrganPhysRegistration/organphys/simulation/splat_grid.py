"""A fine grid round the Gaussians that follow a body: its motion at the nodes, interpolated between them.

Displacement and deformation gradient are known at the nodes of the cells that hold Gaussians and interpolated
trilinearly, each by itself: both are off by about spacing^2 / 8 times their second derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..ground.checks import Array
from .simulation_basis import SimulationBasis

Single = NDArray[np.float32]
CORNERS = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(8, 3)
CHUNK = 4096
Runner = Callable[[Callable[[int], None], int], None]  # does pieces 0, 1, ... of some work


def in_a_row(work: Callable[[int], None], count: int) -> None:
    """All pieces one after the other."""
    for k in range(count):
        work(k)


@dataclass(frozen=True)
class SplatGrid:
    """phi (Nn, n) and slopes (3, Nn, n) per m of a basis at the nodes; corners (C, 8) of the cells that hold points;
    cell (K,) of every point and where in it, part (K, 3) from 0 to 1."""

    phi: Single
    slopes: Single
    corners: NDArray[np.int32]
    cell: NDArray[np.int32]
    part: Single

    @classmethod
    def around(cls, points: Array, basis: SimulationBasis, spacing: float) -> SplatGrid:
        """The grid with cells of edge ``spacing`` m round points (K, 3), m."""
        scaled = points / spacing
        low = np.floor(scaled).astype(np.int64)
        places, cell = _distinct(low)
        nodes, corners = _distinct((places[:, None] + CORNERS).reshape(-1, 3))
        phi = np.empty((len(nodes), basis.size), dtype=np.float32)
        slopes = np.empty((3, len(nodes), basis.size), dtype=np.float32)
        for start in range(0, len(nodes), CHUNK):
            at = slice(start, start + CHUNK)
            phi[at], slopes[:, at] = basis.phi_and_gradient(spacing * nodes[at].astype(np.float64))
        return cls(
            phi,
            slopes,
            corners.reshape(-1, 8).astype(np.int32),
            cell.ravel().astype(np.int32),
            (scaled - low).astype(np.float32),
        )

    def fields(self, z: Array, run: Runner = in_a_row) -> Single:
        """Displacement, m, and F - I at the nodes at base coordinates Z (n, 3): (Nn, 12), u, then F by columns.

        ``run`` may share the chunks out among threads.
        """
        out = np.empty((len(self.phi), 12), dtype=np.float32)
        z32 = np.ascontiguousarray(z, dtype=np.float32)

        def move(k: int) -> None:
            at = slice(k * CHUNK, (k + 1) * CHUNK)
            out[at, :3] = self.phi[at] @ z32
            for m in range(3):
                out[at, 3 * m + 3 : 3 * m + 6] = self.slopes[m, at] @ z32

        run(move, -(-len(out) // CHUNK))
        return out

    def weights(self, points: slice) -> csr_array:
        """Trilinear weights (k, Nn) of some of the points."""
        part, cell = self.part[points], self.cell[points]
        near = np.where(CORNERS.astype(bool), part[:, None, :], 1 - part[:, None, :]).prod(2)
        starts = np.arange(0, 8 * len(cell) + 1, 8, dtype=np.int32)  # as wide as the columns, or they are all copied
        columns = self.corners[cell].ravel()
        return csr_array((near.astype(np.float32).ravel(), columns, starts), (len(cell), len(self.phi)))


def _distinct(places: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Distinct rows (M, 3) of places (N, 3) in their order, and which of them each is (N,): numpy's ``unique``, by one
    number for each row, many times as fast."""
    first, counts = places.min(0), np.ptp(places, axis=0) + 1
    number, which = np.unique(np.ravel_multi_index(tuple((places - first).T), tuple(counts)), return_inverse=True)
    return np.stack(np.unravel_index(number, tuple(counts)), axis=1) + first, which
