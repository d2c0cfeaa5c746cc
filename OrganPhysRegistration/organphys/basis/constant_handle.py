"""The constant handle, w = 1 everywhere: always the last column of the skinning weights."""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array


def with_constant(values: Array) -> Array:
    """Weights (N, H - 1) with the constant handle's column of ones appended: (N, H)."""
    return np.concatenate([values, np.ones((len(values), 1))], axis=1)


def with_constant_gradient(gradients: Array) -> Array:
    """Gradients (N, H - 1, 3) with the constant handle's zeros appended: (N, H, 3)."""
    return np.concatenate([gradients, np.zeros((len(gradients), 1, 3))], axis=1)
