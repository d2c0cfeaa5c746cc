"""The whole splat after a deformation, in the parametrisation of its file: for export, not for every frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..ground.checks import Array
from ..points.gaussians import Gaussians
from .body import Body
from .gaussian_shapes import axes, scales_and_quaternions
from .quick_splat import QuickSplat
from .spherical_harmonics import rotated_harmonics
from .splat_binding import SplatBinding
from .splat_direct import DirectSplat


def moved_splat(
    gaussians: Gaussians, binding: SplatBinding | QuickSplat | DirectSplat, body: Body, z: Array
) -> Gaussians:
    """All Gaussians in their order, the bound ones as they are at Z (n, 3) of ``body``; the others stay bit for bit.

    Means, scales and quaternions follow F; the spherical harmonics turn by the rotation of its polar decomposition.
    """
    index = binding.index
    u, f = (part.astype(np.float64) for part in binding.motion(body, z))
    means, rest = gaussians.means.copy(), gaussians.sh_rest.copy()
    means[index] += u.astype(means.dtype)
    rest[index] = rotated_harmonics(gaussians.sh_rest[index], polar_rotations(f))
    out = replace(gaussians, means=means, sh_rest=rest)
    dimensions = gaussians.log_scales.shape[1]
    if not dimensions or not gaussians.quaternions.shape[1]:
        return out
    scales, quaternions = gaussians.log_scales.copy(), gaussians.quaternions.copy()
    scales[index], quaternions[index] = scales_and_quaternions(f @ axes(gaussians, index), dimensions)
    return replace(out, log_scales=scales, quaternions=quaternions)


def polar_rotations(f: Array) -> Array:
    """Proper rotations (K, 3, 3) nearest to F (K, 3, 3)."""
    u, _, vt = np.linalg.svd(f)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    return u @ vt
