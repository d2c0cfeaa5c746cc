"""The reduced deformation basis of linear blend skinning: x(Z) = X + Phi(X) Z.

Simplicits (Modi et al., ACM TOG 2024) write x = X + B z with B (3N, 12H). Since B = Phi kron I3 only Phi (N, 4H) is
kept: handle h contributes the columns w_h [X0, X1, X2, 1], and Z (4H, 3) stacks the transposed 3 x 4 handle matrices.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ..ground.checks import Array, InputError
from .skinning import SkinningWeights, weights_from_arrays


@dataclass(frozen=True)
class ReducedBasis:
    """Phi = raw Phi @ whitening, with ``whitening`` (4H, 4H) invertible: another choice of coordinates Z."""

    weights: SkinningWeights
    whitening: Array

    @classmethod
    def plain(cls, weights: SkinningWeights) -> ReducedBasis:
        """The paper's coordinates: entries of the handle matrices."""
        return cls(weights, np.eye(4 * weights.handles))

    @classmethod
    def whitened(cls, weights: SkinningWeights, points: Array) -> ReducedBasis:
        """Columns of Phi orthonormal in the mean over the volume points (N, 3): well-conditioned coordinates."""
        raw = raw_phi(weights.values(points), points) / np.sqrt(len(points))
        upper = np.linalg.qr(raw, mode="r")
        if np.abs(np.diag(upper)).min() < 1e-10 * np.abs(np.diag(upper)).max():
            raise InputError(f"basis: {weights.handles} handles are not independent on {len(points)} points, use fewer")
        upper *= np.sign(np.diag(upper))[:, None]
        return cls(weights, scipy.linalg.solve_triangular(upper, np.eye(len(upper))))

    @property
    def size(self) -> int:
        """Number of columns 4H."""
        return 4 * self.weights.handles

    def phi(self, points: Array) -> Array:
        """Phi (N, 4H) at points (N, 3) of the normalised frame."""
        return raw_phi(self.weights.values(points), points) @ self.whitening

    def phi_and_gradient(self, points: Array) -> tuple[Array, Array]:
        """Phi (N, 4H) and its derivatives (3, N, 4H) along the three normalised coordinates."""
        values, gradients = self.weights.values_and_gradients(points)
        ones = np.concatenate([points, np.ones((len(points), 1))], axis=1)
        out = np.empty((3, len(points), self.size))
        for m in range(3):
            term = gradients[:, :, None, m] * ones[:, None, :]
            term[:, :, m] += values
            out[m] = term.reshape(len(points), -1) @ self.whitening
        return raw_phi(values, points) @ self.whitening, out

    def displacement(self, z: Array, points: Array) -> Array:
        """Phi Z (N, 3) at points (N, 3) for Z (4H, 3), without Phi: a half of its time."""
        return _applied(self.weights.mixed(self._handle_columns(z), points).reshape(-1, 4, 3), points)

    def displacement_and_gradient(self, z: Array, points: Array) -> tuple[Array, Array]:
        """Phi Z (N, 3) and its derivative (N, 3, 3), [a, m] = d u_a / d X_m, without Phi: a third of its time."""
        values, gradients = self.weights.mixed_with_gradient(self._handle_columns(z), points)
        affine, slopes = values.reshape(-1, 4, 3), gradients.reshape(-1, 4, 3, 3)
        gradient = np.einsum("nj,njam->nam", points, slopes[:, :3]) + slopes[:, 3]
        gradient += affine[:, :3].transpose(0, 2, 1)
        return _applied(affine, points), gradient

    def _handle_columns(self, z: Array) -> Array:
        """The handles' 3 x 4 matrices, transposed, as rows (H, 12)."""
        columns: Array = (self.whitening @ z).reshape(self.weights.handles, 12)
        return columns

    def similarity_coordinates(self, matrix: Array, shift: Array) -> Array:
        """Z (4H, 3) with Phi(X) Z = matrix @ X + shift exactly, at every X, by the constant handle."""
        raw = np.zeros((self.size, 3))
        raw[-4:-1] = np.asarray(matrix).T
        raw[-1] = shift
        return np.asarray(np.linalg.solve(self.whitening, raw), dtype=np.float64)

    def arrays(self) -> dict[str, Array]:
        """Arrays for the asset file; ``from_arrays`` needs ``weights.kind`` beside them."""
        return {**self.weights.arrays(), "whitening": self.whitening}

    @classmethod
    def from_arrays(cls, kind: str, arrays: Mapping[str, Array]) -> ReducedBasis:
        weights = weights_from_arrays(kind, arrays)
        whitening = np.array(arrays["whitening"], dtype=np.float64)
        if whitening.shape != (4 * weights.handles, 4 * weights.handles):
            raise InputError("stored basis is inconsistent: the file is damaged, write it again")
        return cls(weights, whitening)


def raw_phi(values: Array, points: Array) -> Array:
    """Skinning columns w_h [X0, X1, X2, 1], (N, 4H), from weights (N, H) at points (N, 3)."""
    out = np.empty((len(points), values.shape[1], 4))
    np.multiply(values[:, :, None], points[:, None, :], out=out[:, :, :3])
    out[:, :, 3] = values
    return out.reshape(len(points), -1)


def _applied(affine: Array, points: Array) -> Array:
    """What affine maps (N, 4, 3), transposed, make of points (N, 3)."""
    moved: Array = np.einsum("nm,nma->na", points, affine[:, :3]) + affine[:, 3]
    return moved
