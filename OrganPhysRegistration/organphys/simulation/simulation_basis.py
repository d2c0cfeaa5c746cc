"""Displacement basis of the simulator: u(X) = Phi(X) Z with X and u in metres and Phi orthonormal in the mass.

The functions are those of a Simplicits basis on the geometry to simulate, w_h(X) [X, 1] with RKPM weights w_h, and
components of elastic modes. The volume mean of Phi^T Phi is the identity: the mass matrix is the body's mass times
the identity. Local functions may be added, orthonormal to the rest: the other coordinates keep their meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..basis.reproducing_kernel import ReproducingKernel
from ..ground.checks import Array
from ..ground.frames import Normalisation
from .local_functions import LocalFunctions

CHUNK = 1024
INDEPENDENT = 1e-9  # columns whose squared norm beside the others is below this part of their own are left out


class LocalColumns(NamedTuple):
    """Columns (N, k): functions times ``mixing`` minus the other columns times ``overlap``."""

    functions: LocalFunctions
    mixing: Array
    overlap: Array


@dataclass(frozen=True)
class SimulationBasis:
    """Raw functions in X = (x - centre) / length: [1, X], then w_h [1, X] of the ``handles`` first columns of the
    ``coefficients`` (nodes, k) of the kernel, then the other columns as they are; Phi = raw @ ``mixing`` (r, n)."""

    normalisation: Normalisation
    kernel: ReproducingKernel
    coefficients: Array
    handles: int
    mixing: Array
    local: LocalColumns | None = None

    @classmethod
    def orthonormal(
        cls,
        normalisation: Normalisation,
        kernel: ReproducingKernel,
        coefficients: Array,
        handles: int,
        points: Array,
        volumes: Array,
    ) -> SimulationBasis:
        """Basis whose mean of Phi^T Phi over points (N, 3) m with volumes (N,) is the identity."""
        size = 4 * (1 + handles) + coefficients.shape[1] - handles
        plain = cls(normalisation, kernel, coefficients, handles, np.eye(size))
        raw = plain.phi(points) * np.sqrt(volumes / volumes.sum())[:, None]
        affine = _orthonormal(raw[:, :4].T @ raw[:, :4], (raw[:, :4] ** 2).sum(0))
        overlap = affine.T @ (raw[:, :4].T @ raw[:, 4:])
        beside = raw[:, 4:] - raw[:, :4] @ (affine @ overlap)
        rest = _orthonormal(beside.T @ beside, (raw[:, 4:] ** 2).sum(0))
        mixing = np.zeros((size, affine.shape[1] + rest.shape[1]))
        mixing[:4, :4], mixing[:4, 4:], mixing[4:, 4:] = affine, -affine @ overlap @ rest, rest
        return replace(plain, mixing=mixing)

    @property
    def size(self) -> int:
        """Number n of columns; Z is (n, 3) in metres."""
        return self.mixing.shape[1] + (0 if self.local is None else self.local.mixing.shape[1])

    def phi(self, points: Array) -> Array:
        """Phi (N, n) at points (N, 3) in m."""
        x, out = self.normalisation.apply(points), np.empty((len(points), self.size))
        base = out[:, : self.mixing.shape[1]]
        for start in range(0, len(x), CHUNK):
            part = slice(start, start + CHUNK)
            base[part] = self._raw(x[part], self.kernel.combined(self.coefficients, x[part])) @ self.mixing
        if self.local is not None:
            out[:, base.shape[1] :] = self.local_values(base, self.local.functions.values(points))
        return out

    def phi_and_gradient(self, points: Array) -> tuple[Array, Array]:
        """Phi (N, n) and its derivatives (3, N, n) per metre."""
        x, size = self.normalisation.apply(points), self.mixing.shape[1]
        out, slopes = np.empty((len(points), self.size)), np.empty((3, len(points), self.size))
        for start in range(0, len(x), CHUNK):
            part = slice(start, start + CHUNK)
            values, gradients = self.kernel.combined_with_gradient(self.coefficients, x[part])
            out[part, :size] = self._raw(x[part], values) @ self.mixing
            for m in range(3):
                slopes[m, part, :size] = self._raw_slope(x[part], values, gradients[:, :, m], m) @ self.mixing
        slopes[:, :, :size] /= self.normalisation.length
        if self.local is not None:
            values, local_slopes = self.local.functions.values_and_gradients(points)
            out[:, size:] = self.local_values(out[:, :size], values)
            slopes[:, :, size:] = self.local_values(slopes[:, :, :size], local_slopes)
        return out, slopes

    def motion(self, z: Array, points: Array) -> tuple[Array, Array]:
        """Displacement (N, 3) m and its derivative (N, 3, 3), [a, m] = d u_a / d X_m, at Z (n, 3) of the columns that
        are not local; without Phi, so that a moment of many points (N, 3) m costs a third of the time and no memory.
        """
        x, raw, h = self.normalisation.apply(points), self.mixing @ z, self.handles
        columns = self.coefficients[:, :h] @ raw[4 : 4 + 4 * h].reshape(h, 12)  # of [1, x] times u_a, by node
        columns[:, :3] += self.coefficients[:, h:] @ raw[4 + 4 * h :]
        u, slopes = np.empty((len(x), 3)), np.empty((len(x), 3, 3))
        for start in range(0, len(x), CHUNK):
            at = x[start : start + CHUNK]
            values, gradients = self.kernel.combined_with_gradient(columns, at)
            affine, slope = values.reshape(-1, 4, 3) + raw[:4].reshape(4, 3), gradients.reshape(-1, 4, 3, 3)
            u[start : start + CHUNK] = affine[:, 0] + np.einsum("nm,nma->na", at, affine[:, 1:])
            total = slope[:, 0] + affine[:, 1:].transpose(0, 2, 1) + np.einsum("nj,njam->nam", at, slope[:, 1:])
            slopes[start : start + CHUNK] = total / self.normalisation.length
        return u, slopes

    def affine_coordinates(self, matrix: Array, shift: Array) -> Array:
        """Z (n, 3) of the displacement u(X) = matrix @ X + shift (X, shift in m), exact at every X."""
        about = self.normalisation
        raw = np.vstack([matrix @ about.centre + shift, about.length * np.asarray(matrix).T])
        z = np.zeros((self.size, 3))
        z[:4] = np.linalg.solve(self.mixing[:4, :4], raw)
        return z

    def with_local(self, functions: LocalFunctions, phi: Array, values: Array, share: Array) -> SimulationBasis:
        """This basis with other local functions, made orthonormal.

        phi (k, n) without local columns and ``values`` of the functions at all points where they are not zero, which
        hold ``share`` (k,) of the volume.
        """
        overlap = phi.T @ (share[:, None] * values)
        own = values.T @ (share[:, None] * values)
        mixing = _orthonormal(own - overlap.T @ overlap, np.diag(own))
        return replace(self, local=LocalColumns(functions, mixing, overlap @ mixing))

    def local_values(self, base: Array, values: Array) -> Array:
        """Local columns from the other columns ``base`` (..., n) and the functions' ``values`` (..., k), or slopes."""
        assert self.local is not None
        return values @ self.local.mixing - base @ self.local.overlap

    def _raw(self, x: Array, values: Array) -> Array:
        ones = np.concatenate([np.ones((len(x), 1)), x], axis=1)
        skinned = values[:, : self.handles, None] * ones[:, None, :]
        return np.concatenate([ones, skinned.reshape(len(x), -1), values[:, self.handles :]], axis=1)

    def _raw_slope(self, x: Array, values: Array, slope: Array, axis: int) -> Array:
        ones = np.concatenate([np.ones((len(x), 1)), x], axis=1)
        constant = np.zeros((len(x), 4))
        constant[:, 1 + axis] = 1.0
        skinned = slope[:, : self.handles, None] * ones[:, None, :]
        skinned[:, :, 1 + axis] += values[:, : self.handles]
        return np.concatenate([constant, skinned.reshape(len(x), -1), slope[:, self.handles :]], axis=1)


def _orthonormal(gram: Array, scale: Array) -> Array:
    """Matrix (k, n), n <= k, that makes columns with this Gram matrix (k, k) orthonormal.

    ``scale`` (k,): squared norms of the columns before others were taken out of them.
    """
    norms = np.maximum(np.sqrt(scale), 1e-100)  # a column that is zero is left out
    size, vectors = np.linalg.eigh(gram / np.outer(norms, norms))
    kept = size > INDEPENDENT
    return (vectors[:, kept] / np.sqrt(size[kept])) / norms[:, None]
