"""Rotation of the spherical harmonics of Gaussians, in the order and with the signs of 3D Gaussian splatting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array

CHUNK = 4096


def harmonics(directions: Array, degree: int) -> Array:
    """Basis functions (..., 2 degree + 1) of one degree, 1 to 4, at unit directions (..., 3).

    Polynomials and signs of the 3DGS renderer (Kerbl et al., 2023; computeColorFromSH), degree 4 as gsplat has it.
    """
    x, y, z = np.moveaxis(directions, -1, 0)
    xx, yy, zz = x * x, y * y, z * z
    terms: dict[int, list[Array]] = {
        1: [-0.4886025119029199 * y, 0.4886025119029199 * z, -0.4886025119029199 * x],
        2: [
            1.0925484305920792 * x * y,
            -1.0925484305920792 * y * z,
            0.31539156525252005 * (2 * zz - xx - yy),
            -1.0925484305920792 * x * z,
            0.5462742152960396 * (xx - yy),
        ],
        3: [
            -0.5900435899266435 * y * (3 * xx - yy),
            2.890611442640554 * x * y * z,
            -0.4570457994644658 * y * (4 * zz - xx - yy),
            0.3731763325901154 * z * (2 * zz - 3 * xx - 3 * yy),
            -0.4570457994644658 * x * (4 * zz - xx - yy),
            1.445305721320277 * z * (xx - yy),
            -0.5900435899266435 * x * (xx - 3 * yy),
        ],
        4: [
            2.5033429417967046 * x * y * (xx - yy),
            -1.7701307697799304 * y * z * (3 * xx - yy),
            0.9461746957575601 * x * y * (7 * zz - 1),
            -0.6690465435572892 * y * z * (7 * zz - 3),
            0.10578554691520431 * (zz * (35 * zz - 30) + 3),
            -0.6690465435572892 * x * z * (7 * zz - 3),
            0.47308734787878004 * (xx - yy) * (7 * zz - 1),
            -1.7701307697799304 * x * z * (xx - 3 * yy),
            0.6258357354491761 * (xx * (xx - 3 * yy) - yy * (3 * xx - yy)),
        ],
    }
    return np.stack(terms[degree], axis=-1)


def rotated_harmonics(sh_rest: NDArray[np.floating], rotations: Array) -> NDArray[np.floating]:
    """Coefficients (K, 3, C), C = 0, 3, 8, 15 or 24, of the colours seen when the Gaussians turn by (K, 3, 3).

    The colour towards R d after the turn is that towards d before it.
    """
    out = np.array(sh_rest)
    degrees = round((sh_rest.shape[2] + 1) ** 0.5) - 1
    for degree in range(1, degrees + 1):
        columns = slice(degree**2 - 1, (degree + 1) ** 2 - 1)
        directions = _spread(4 * degree + 6)
        known = np.linalg.pinv(harmonics(directions, degree))
        for start in range(0, len(out), CHUNK):
            part = slice(start, start + CHUNK)
            before = harmonics(directions @ rotations[part], degree)  # rows d^T R = (R^T d)^T
            out[part, :, columns] = out[part, :, columns] @ (known @ before).transpose(0, 2, 1)
    return out


def _spread(count: int) -> Array:
    """Unit directions (count, 3), spread evenly on a golden spiral."""
    k = np.arange(count) + 0.5
    height, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)
