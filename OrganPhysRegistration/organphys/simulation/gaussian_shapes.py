"""Covariances of Gaussians from scales and quaternions, and back after a deformation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..ground.checks import Array
from ..points.gaussians import Gaussians

LEAST = 1e-12  # scales are not taken below this part of the largest


def axes(gaussians: Gaussians, index: NDArray[np.int64]) -> Array:
    """R S (K, 3, 3): columns are the semi-axes in scene units; 2D Gaussians have a third of length 0, points none."""
    scales = np.zeros((len(index), 3))
    dimensions = gaussians.log_scales.shape[1]
    scales[:, :dimensions] = np.exp(gaussians.log_scales[index].astype(np.float64))
    return rotations(gaussians, index) * scales[:, None, :]


def covariances(gaussians: Gaussians, index: NDArray[np.int64]) -> Array:
    """R S^2 R^T (K, 3, 3) in squared scene units."""
    a = axes(gaussians, index)
    return a @ a.transpose(0, 2, 1)


def rotations(gaussians: Gaussians, index: NDArray[np.int64]) -> Array:
    """Rotation matrices (K, 3, 3) of the quaternions w, x, y, z; the identity where there are none."""
    if not gaussians.quaternions.shape[1]:
        return np.tile(np.eye(3), (len(index), 1, 1))
    quaternions = gaussians.quaternions[index].astype(np.float64)
    matrices: Array = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix()
    return matrices


def scales_and_quaternions(deformed: Array, dimensions: int) -> tuple[Array, Array]:
    """log_scales (K, ``dimensions``) and quaternions (K, 4) w, x, y, z of F R S (K, 3, 3), by its singular values.

    The largest comes first; F R S S R^T F^T is the covariance of the result.
    """
    u, sizes, _ = np.linalg.svd(deformed)
    u[:, :, 2] *= np.linalg.det(u)[:, None]
    sizes = np.maximum(sizes, LEAST * np.maximum(sizes[:, :1], 1e-30))
    return np.log(sizes[:, :dimensions]), Rotation.from_matrix(u).as_quat()[:, [3, 0, 1, 2]]
