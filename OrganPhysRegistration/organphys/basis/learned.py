"""The original learned skinning weights of Simplicits: a small ELU network, evaluated here in numpy.

Modi et al., "Simplicits: Mesh-Free, Geometry-Agnostic, Elastic Simulation", ACM TOG 2024, section 4. Training needs
torch (basis/learned_training.py); evaluation, also of stored weights, does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..ground.checks import Array, InputError
from ..ground.progress import Progress, no_progress
from .constant_handle import with_constant, with_constant_gradient

CHUNK = 4096


@dataclass(frozen=True)
class LearnedWeights:
    """Network (matrices W_k (in, out), offsets b_k (out,)) with ELU between the layers, and the constant handle last.

    Its input is (X - centre) / extent, with X in the normalised frame; its last layer has H - 1 outputs.
    """

    matrices: tuple[Array, ...]
    offsets: tuple[Array, ...]
    centre: Array
    extent: float
    kind: str = "learned"

    @property
    def handles(self) -> int:
        return len(self.offsets[-1]) + 1

    def values(self, points: Array) -> Array:
        """Weights (N, H) at points (N, 3) of the normalised frame, also outside the organ."""
        parts = [self._forward(points[i : i + CHUNK]) for i in range(0, len(points), CHUNK)]
        return with_constant(np.concatenate(parts) if parts else np.empty((0, self.handles - 1)))

    def values_and_gradients(self, points: Array) -> tuple[Array, Array]:
        """Weights (N, H) and derivatives (N, H, 3) with respect to the normalised coordinates."""
        values, gradients = np.empty((len(points), self.handles - 1)), np.empty((len(points), self.handles - 1, 3))
        for start in range(0, len(points), CHUNK):
            part = slice(start, start + CHUNK)
            values[part], gradients[part] = self._forward_with_gradient(points[part])
        return with_constant(values), with_constant_gradient(gradients)

    def mixed(self, columns: Array, points: Array) -> Array:
        """sum_h w_h(X) columns_h (N, k) at points (N, 3), for columns (H, k)."""
        return self.values(points) @ columns

    def mixed_with_gradient(self, columns: Array, points: Array) -> tuple[Array, Array]:
        """The same and its derivatives (N, k, 3)."""
        values, gradients = self.values_and_gradients(points)
        return values @ columns, (gradients.transpose(0, 2, 1) @ columns).transpose(0, 2, 1)

    def arrays(self) -> dict[str, Array]:
        out = {"centre": self.centre, "extent": np.array(self.extent)}
        for k, (matrix, offset) in enumerate(zip(self.matrices, self.offsets, strict=True)):
            out[f"matrix_{k}"], out[f"offset_{k}"] = matrix, offset
        return out

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Array]) -> LearnedWeights:
        count = sum(name.startswith("matrix_") for name in arrays)
        matrices = tuple(np.array(arrays[f"matrix_{k}"], dtype=np.float64) for k in range(count))
        offsets = tuple(np.array(arrays[f"offset_{k}"], dtype=np.float64) for k in range(count))
        widths = [3, *(len(offset) for offset in offsets)]
        if not count or any(m.shape != (widths[k], widths[k + 1]) for k, m in enumerate(matrices)):
            raise InputError("stored learned weights are inconsistent: the file is damaged, write it again")
        centre = np.array(arrays["centre"], dtype=np.float64).reshape(3)
        return cls(matrices, offsets, centre, float(arrays["extent"]))

    def _forward(self, points: Array) -> Array:
        value = (points - self.centre) / self.extent
        for matrix, offset in zip(self.matrices[:-1], self.offsets[:-1], strict=True):
            value = _elu(value @ matrix + offset)
        return value @ self.matrices[-1] + self.offsets[-1]

    def _forward_with_gradient(self, points: Array) -> tuple[Array, Array]:
        value = (points - self.centre) / self.extent
        slope = np.repeat(np.eye(3)[:, None, :] / self.extent, len(points), axis=1)  # (3, N, width)
        for matrix, offset in zip(self.matrices[:-1], self.offsets[:-1], strict=True):
            value = _elu(value @ matrix + offset)
            slope = (slope @ matrix) * np.where(value > 0, 1.0, value + 1.0)  # elu'(u) = e^u = elu(u) + 1 for u < 0
        return value @ self.matrices[-1] + self.offsets[-1], (slope @ self.matrices[-1]).transpose(1, 2, 0)


def _elu(u: Array) -> Array:
    return np.where(u > 0, u, np.expm1(np.minimum(u, 0.0)))


def learned_weights(
    points: Array,
    *,
    handles: int = 20,
    steps: int = 1500,
    seed: int = 0,
    progress: Progress = no_progress,
    device: str = "cpu",
) -> LearnedWeights:
    """Weights trained on volume points (N, 3) of the normalised frame; InputError when torch is not installed."""
    from .learned_training import TrainingOptions, train

    return train(points, TrainingOptions(handles=handles, steps=steps, seed=seed, device=device), progress=progress)
