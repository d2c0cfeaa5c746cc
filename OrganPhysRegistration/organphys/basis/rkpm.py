"""Skinning weights from a reproducing-kernel (RKPM) eigenproblem: no training, a fraction of a second.

The weights are the lowest generalised eigenvectors of the stiffness weighted by lambda + 4 mu,
K_IJ = sum_q (lam + 4 mu) grad phi_I . grad phi_J, against the mass M_IJ = sum_q phi_I phi_J (Modi et al.,
"Simplicits", ACM TOG 2024, and the OrganPhys paper, section 3.5); the constant mode is replaced by the constant
handle. In a homogeneous organ lam + 4 mu scales the eigenvalues and drops out of the eigenvectors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError, as_points
from ..points.sampling import farthest_points, random_subset
from .constant_handle import with_constant, with_constant_gradient
from .reproducing_kernel import ReproducingKernel

CHUNK = 1024  # points evaluated at once: bounds the memory to some 20 MB at 400 nodes


@dataclass(frozen=True)
class RkpmWeights:
    """Weights w_h(X) = sum_I phi_I(X) c_Ih, h < H - 1, and the constant handle as the last.

    nodes (n, 3) and radii (n,) of the kernels in the normalised frame, coefficients c (n, H - 1).
    """

    nodes: Array
    radii: Array
    coefficients: Array
    kind: str = "rkpm"

    @property
    def handles(self) -> int:
        return self.coefficients.shape[1] + 1

    def values(self, points: Array) -> Array:
        """Weights (N, H) at points (N, 3) of the normalised frame, also outside the organ."""
        return with_constant(self._combined(self.coefficients, points))

    def values_and_gradients(self, points: Array) -> tuple[Array, Array]:
        """Weights (N, H) and derivatives (N, H, 3) with respect to the normalised coordinates."""
        values, gradients = self._combined_with_gradient(self.coefficients, points)
        return with_constant(values), with_constant_gradient(gradients)

    def mixed(self, columns: Array, points: Array) -> Array:
        """sum_h w_h(X) columns_h (N, k) at points (N, 3), for columns (H, k): quicker than by the weights for few."""
        return self._combined(self.coefficients @ columns[:-1], points) + columns[-1]

    def mixed_with_gradient(self, columns: Array, points: Array) -> tuple[Array, Array]:
        """The same and its derivatives (N, k, 3)."""
        values, gradients = self._combined_with_gradient(self.coefficients @ columns[:-1], points)
        return values + columns[-1], gradients

    def arrays(self) -> dict[str, Array]:
        return {"nodes": self.nodes, "radii": self.radii, "coefficients": self.coefficients}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> RkpmWeights:
        nodes, radii, coefficients = (
            np.array(arrays[name], dtype=np.float64) for name in ("nodes", "radii", "coefficients")
        )
        if nodes.shape != (len(radii), 3) or coefficients.ndim != 2 or len(coefficients) != len(radii):
            raise InputError("stored RKPM weights are inconsistent: the file is damaged, write it again")
        return cls(nodes, radii, coefficients)

    def _combined(self, coefficients: Array, points: Array) -> Array:
        kernel, out = self._kernel, np.empty((len(points), coefficients.shape[1]))
        for start in range(0, len(points), CHUNK):
            out[start : start + CHUNK] = kernel.combined(coefficients, points[start : start + CHUNK])
        return out

    def _combined_with_gradient(self, coefficients: Array, points: Array) -> tuple[Array, Array]:
        kernel, k = self._kernel, coefficients.shape[1]
        values, gradients = np.empty((len(points), k)), np.empty((len(points), k, 3))
        for start in range(0, len(points), CHUNK):
            part = slice(start, start + CHUNK)
            values[part], gradients[part] = kernel.combined_with_gradient(coefficients, points[part])
        return values, gradients

    @property
    def _kernel(self) -> ReproducingKernel:
        return ReproducingKernel(self.nodes, self.radii)


def rkpm_weights(
    points: Array,
    *,
    handles: int = 20,
    nodes: int = 400,
    samples: int = 3000,
    seed: int = 0,
    stiffness: Array | None = None,
) -> RkpmWeights:
    """RKPM weights with ``handles`` handles (constant one included) on volume points (N, 3), normalised frame.

    ``nodes`` kernel centres by farthest-point sampling, stiffness and mass summed over ``samples`` points; N beyond
    4 times the samples is subsampled first (seeded). ``stiffness`` (N,): lam + 4 mu at the points when it varies.
    """
    points = as_points(points, "volume points", minimum=8)
    if handles < 1:
        raise InputError(f"handles: expected at least 1, got {handles}")
    if min(nodes, len(points)) < handles + 4:
        raise InputError(f"handles: {handles} handles need more than {handles + 4} nodes and points, use fewer")
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(points.T)), 0.0))
    if spread[0] < 1e-6 * spread[2]:
        raise InputError("volume points: they lie in a plane, one voxel thick; check the label or resample it")
    few = random_subset(len(points), 4 * max(samples, nodes), seed)
    centres = points[few[farthest_points(points[few], nodes)]]
    kernel = ReproducingKernel(centres, _radii(centres, points[few]))
    at = few[random_subset(len(few), samples, seed + 1)]
    weight = np.ones(len(at)) if stiffness is None else np.asarray(stiffness, dtype=np.float64)[at]
    coefficients = _lowest_modes(kernel, points[at], weight, handles)
    return RkpmWeights(kernel.nodes, kernel.radii, coefficients)


def _radii(centres: Array, points: Array) -> Array:
    """Kernel radii (n,): distance to the second nearest node, at least three point spacings."""
    spacing = float(np.median(cKDTree(points).query(points[:: max(1, len(points) // 2000)], k=2)[0][:, 1]))
    return np.maximum(cKDTree(centres).query(centres, k=3)[0][:, 2], 3 * spacing)


def _lowest_modes(kernel: ReproducingKernel, points: Array, weight: Array, handles: int) -> Array:
    """Coefficients (n, handles - 1) of the lowest non-constant modes, unit mean square over the points."""
    count = len(kernel.nodes)
    mass, stiff = np.zeros((count, count)), np.zeros((count, count))
    for start in range(0, len(points), CHUNK):
        part = slice(start, start + CHUNK)
        shapes, gradients = kernel.shapes_with_gradient(points[part])
        mass += shapes.T @ shapes
        flat = (gradients * np.sqrt(weight[part])[None, :, None]).reshape(-1, count)
        stiff += flat.T @ flat
    mass[np.diag_indices(count)] += 1e-10 * np.trace(mass) / count  # nodes that no sample sees
    _, modes = scipy.linalg.eigh(stiff, mass, subset_by_index=[0, handles - 1], check_finite=False)
    modes = modes[:, 1:] * np.sqrt(len(points))
    largest = np.abs(modes).argmax(0)
    return modes * np.sign(modes[largest, np.arange(modes.shape[1])])  # eigenvectors have no sign of their own
