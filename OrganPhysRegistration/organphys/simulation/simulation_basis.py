"""Displacement basis of the simulator: u(X) = Phi(X) Z with X and u in metres and Phi orthonormal in the mass.

The columns are those of a Simplicits basis on the geometry to simulate, whitened so that the volume mean of
Phi^T Phi is the identity: the mass matrix is the body's mass times the identity. Local functions may be added; they
are made orthonormal to the rest, so the coordinates of the other columns keep their meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg

from ..basis.reduced_basis import ReducedBasis
from ..basis.skinning import SkinningWeights
from ..ground.checks import Array, InputError
from ..ground.frames import Normalisation
from .local_functions import LocalFunctions


class LocalColumns(NamedTuple):
    """Columns (N, k): functions times ``mixing`` minus columns of the skinning times ``overlap`` (4H, k)."""

    functions: LocalFunctions
    mixing: Array
    overlap: Array


@dataclass(frozen=True)
class SimulationBasis:
    """``skinning``: whitened reduced basis in X = (x - centre) / length, 4H columns; ``local``: further columns."""

    normalisation: Normalisation
    skinning: ReducedBasis
    local: LocalColumns | None = None

    @classmethod
    def orthonormal(
        cls, weights: SkinningWeights, normalisation: Normalisation, points: Array, volumes: Array
    ) -> SimulationBasis:
        """Basis whose mean of Phi^T Phi over points (N, 3) m with volumes (N,) is the identity."""
        x = normalisation.apply(points)
        plain = ReducedBasis.plain(weights).phi(x) * np.sqrt(volumes / volumes.sum())[:, None]
        upper = np.linalg.qr(plain, mode="r")
        if np.abs(np.diag(upper)).min() < 1e-10 * np.abs(np.diag(upper)).max():
            raise InputError(f"handles: {weights.handles} handles are not independent on this organ, use fewer")
        upper *= np.sign(np.diag(upper))[:, None]
        whitening = scipy.linalg.solve_triangular(upper, np.eye(len(upper)))
        return cls(normalisation, ReducedBasis(weights, whitening))

    @property
    def size(self) -> int:
        """Number n of columns; Z is (n, 3) in metres."""
        return self.skinning.size + (0 if self.local is None else self.local.mixing.shape[1])

    def phi(self, points: Array) -> Array:
        """Phi (N, n) at points (N, 3) in m."""
        base = self.skinning.phi(self.normalisation.apply(points))
        if self.local is None:
            return base
        functions, mixing, overlap = self.local
        return np.concatenate([base, functions.values(points) @ mixing - base @ overlap], axis=1)

    def phi_and_gradient(self, points: Array) -> tuple[Array, Array]:
        """Phi (N, n) and its derivatives (3, N, n) per metre."""
        base, slopes = self.skinning.phi_and_gradient(self.normalisation.apply(points))
        slopes /= self.normalisation.length
        if self.local is None:
            return base, slopes
        functions, mixing, overlap = self.local
        values, gradients = functions.values_and_gradients(points)
        extra, extra_slopes = values @ mixing - base @ overlap, gradients @ mixing - slopes @ overlap
        return np.concatenate([base, extra], axis=1), np.concatenate([slopes, extra_slopes], axis=2)

    def affine_coordinates(self, matrix: Array, shift: Array) -> Array:
        """Z (n, 3) of the displacement u(X) = matrix @ X + shift (X, shift in m), exact at every X."""
        about = self.normalisation
        z = np.zeros((self.size, 3))
        z[: self.skinning.size] = self.skinning.similarity_coordinates(
            about.length * matrix, matrix @ about.centre + shift
        )
        return z

    def with_local(self, local: LocalFunctions, points: Array, volumes: Array) -> SimulationBasis:
        """This basis without its old local functions and with new ones, orthonormal over points (N, 3), volumes (N,).

        Functions that the others nearly represent already (norm below 1e-6 of the largest) are left out.
        """
        base = replace(self, local=None)
        share = (volumes / volumes.sum())[:, None]
        phi, values = base.phi(points), local.values(points)
        overlap = phi.T @ (share * values)
        rest = values - phi @ overlap
        size, vectors = np.linalg.eigh(rest.T @ (share * rest))
        kept = size > 1e-6 * size.max()
        mixing = vectors[:, kept] / np.sqrt(size[kept])
        return replace(base, local=LocalColumns(local, mixing, overlap @ mixing))
