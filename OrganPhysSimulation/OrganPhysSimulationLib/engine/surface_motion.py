"""The organ's surface as it moves: vertices, smooth normals, displacement and stretch, a few milliseconds a frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from organphys.ground.checks import Array
from organphys.simulation.body import Body

TINY = 1e-30


@dataclass(frozen=True)
class SurfaceMotion:
    """rest (N, 3) m, faces (F, 3) and the basis phi (N, n) of the body without local functions at the vertices."""

    rest: Array
    faces: NDArray[np.int64]
    phi: NDArray[np.float32]

    @classmethod
    def of(cls, body: Body) -> SurfaceMotion:
        """The surface of a body, or of the same body with local functions."""
        plain = body.plain or body
        vertices = plain.samples.vertices
        return cls(vertices, plain.samples.faces, plain.basis.phi(vertices).astype(np.float32))

    def displacement(self, body: Body, z: Array) -> Array:
        """Displacements (N, 3) m at Z (n, 3); the body may have gained local functions since."""
        n, local = self.phi.shape[1], body.basis.local
        base = z[:n] if local is None else z[:n] - local.overlap @ z[n:]
        moved = (self.phi @ base.astype(np.float32)).astype(np.float64)
        if local is not None:
            near = np.flatnonzero(((self.rest - local.functions.middle) ** 2).sum(1) < local.functions.reach**2)
            moved[near] += local.functions.values(self.rest[near]) @ (local.mixing @ z[n:])
        return moved

    def normals(self, vertices: Array) -> NDArray[np.float32]:
        """Unit normals (N, 3), outward, weighted by area."""
        (ax, ay, az), (bx, by, bz) = self._edges(vertices)
        across = np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)
        normals = self._mean @ across
        length = np.sqrt(np.einsum("ij,ij->i", normals, normals))
        return normals / np.maximum(length, np.float32(TINY))[:, None]

    def stretch(self, vertices: Array) -> NDArray[np.float32]:
        """Largest stretch of the surface (N,) minus 1: the larger principal stretch in the plane of its triangles."""
        (ax, ay, az), (bx, by, bz) = self._edges(vertices)
        x, y, height = self._rest_triangles
        p = (ax * ax + ay * ay + az * az) * x**2  # metric in two orthonormal rest directions: p r, r q
        cx, cy, cz = (height * (b - y * a) for a, b in ((ax, bx), (ay, by), (az, bz)))
        q, r = cx * cx + cy * cy + cz * cz, (ax * cx + ay * cy + az * cz) * x
        largest = np.sqrt((p + q) / 2 + np.sqrt(((p - q) / 2) ** 2 + r * r))
        mean: NDArray[np.float32] = (self._mean @ largest) / self._count
        return mean - 1

    def _edges(self, vertices: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Two edges (3, F) of every triangle, m, from its first vertex."""
        planes = np.ascontiguousarray((vertices - self.rest[0]).T, dtype=np.float32)
        first = planes[:, self._corners[0]]
        return planes[:, self._corners[1]] - first, planes[:, self._corners[2]] - first

    @cached_property
    def _corners(self) -> NDArray[np.int64]:
        return np.ascontiguousarray(self.faces.T)

    @cached_property
    def _rest_triangles(self) -> tuple[NDArray[np.float32], ...]:
        """1 / length of the first edge, foot of the second on it in its lengths, 1 / height; 0 for flat triangles."""
        a, b = (edge.astype(np.float64) for edge in self._edges(self.rest))
        along = np.maximum((a * a).sum(0), TINY)
        foot = (a * b).sum(0) / along
        height = np.sqrt(((b - foot * a) ** 2).sum(0))
        usable = height > 1e-6 * np.sqrt(along)
        inverse = np.where(usable, 1 / np.maximum(height, TINY), 0.0)
        return tuple(np.asarray(part, dtype=np.float32) for part in (1 / np.sqrt(along), foot, inverse))

    @cached_property
    def _mean(self) -> Any:
        """Sparse (N, F): sums over the triangles of a vertex."""
        columns = np.repeat(np.arange(len(self.faces)), 3)
        ones = np.ones(len(columns), dtype=np.float32)
        return sparse.csr_matrix((ones, (self.faces.ravel(), columns)), shape=(len(self.rest), len(self.faces)))

    @cached_property
    def _count(self) -> NDArray[np.float32]:
        return np.maximum(np.asarray(self._mean.sum(1)).ravel(), 1).astype(np.float32)
