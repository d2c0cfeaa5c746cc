"""Noise taken out of surface samples: each is put on a quadratic patch fitted to the points around it.

A plane would flatten curved surfaces and so bend their normals; a quadric in the sample's own tangent frame,
h(a, b) = c0 + c1 a + c2 b + c3 a^2 + c4 a b + c5 b^2, keeps curvature (jet fitting, Cazals and Pouget 2005).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..ground.frames import tangent_axes
from ..points.neighbours import nearest_neighbours

OUTLYING = 2.5  # residuals beyond so many standard deviations count little
RIDGE = 1e-6  # keeps the fit solvable where the neighbours lie on a line


def on_patches(points: Array, samples: Array, normals: Array, *, neighbours: int) -> tuple[Array, Array]:
    """Samples (M, 3) moved onto the patch through their nearest ``points`` (N, 3), straight to their plane.

    Returns the new places and the patches' unit normals there, on the side of ``normals`` (M, 3). Lengths in any unit.
    """
    tree = cKDTree(points, balanced_tree=False)  # built in half of the time, and asked once
    index = nearest_neighbours(tree, samples, k=min(neighbours, len(points)))[1]
    offset = points[index] - samples[:, None]
    normals = _of_plane(offset, normals)
    first, second = tangent_axes(normals)
    a, b, height = (np.einsum("mkc,mc->mk", offset, axis) for axis in (first, second, normals))
    reach = np.sqrt(a * a + b * b).max(1, keepdims=True) + 1e-300
    a, b = a / reach, b / reach
    design = np.stack([np.ones_like(a), a, b, a * a, a * b, b * b], axis=-1)
    near = np.clip(1 - a * a - b * b, 0.02, None)
    found = _weighted_fit(design, near, height)
    residual = height - (design @ found[..., None])[..., 0]
    spread = 1.5 * np.median(np.abs(residual), axis=1, keepdims=True) + 1e-300
    found = _weighted_fit(design, near / (1 + (residual / (OUTLYING * spread)) ** 2) ** 2, height)
    tilted = normals - (found[:, 1:2] * first + found[:, 2:3] * second) / reach
    return samples + found[:, :1] * normals, tilted / np.linalg.norm(tilted, axis=1, keepdims=True)


def _of_plane(offset: Array, normals: Array) -> Array:
    """Unit normals (M, 3) of the least-squares planes of offsets (M, K, 3), on the side of ``normals``."""
    local = offset - offset.mean(1, keepdims=True)
    found = np.linalg.eigh(local.transpose(0, 2, 1) @ local)[1][:, :, 0]
    return found * np.where(np.einsum("ij,ij->i", found, normals) < 0, -1.0, 1.0)[:, None]


def _weighted_fit(design: Array, weights: Array, values: Array) -> Array:
    """Least squares of M independent fits: design (M, K, P), weights and values (M, K); coefficients (M, P)."""
    weighted = (design * weights[..., None]).transpose(0, 2, 1)
    normal = weighted @ design + RIDGE * design.shape[1] * np.eye(design.shape[2])
    solved: Array = np.linalg.solve(normal, weighted @ values[..., None])[..., 0]
    return solved
