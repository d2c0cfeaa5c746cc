"""The elastic Hessian as a matrix, in single precision: for the preconditioner, which need not be exact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..mechanics.determinant import cofactor
from .strain_energy import StrainEnergy

Single = NDArray[np.float32]


def stiffness_matrix(strain: StrainEnergy, z: Array, *, definite: bool = False) -> Array:
    """Second derivative (3n, 3n), N/m, of the elastic energy at Z (n, 3), in the order of Z.ravel().

    Of the density mu/2 |F|^2 + g(J) it is mu I + g'' cof cof^T + g' dcof/dF. ``definite`` leaves the last term out,
    which may be indefinite.
    """
    f = strain.gradients(z)
    cof = cofactor(f)
    _, slope, curvature = strain.material.volumetric((f[0] * cof[0]).sum(0))
    weights, mu = strain.weights, strain.material.mu
    bulk, bend = (weights * curvature).astype(np.float32), (weights * slope).astype(np.float32)
    c, f32, plain = cof.astype(np.float32), f.astype(np.float32), (weights * mu).astype(np.float32)
    rows = strain.rows32.reshape(3, len(weights), -1)
    n = rows.shape[2]
    out, scaled = np.empty((n, 3, n, 3)), np.empty_like(rows)
    for a in range(3):
        for b in range(a, 3):
            for m in range(3):
                _scale(scaled[m], rows, _blocks(a, b, m, c, bulk, None if definite else bend, f32, plain))
            block = strain.rows32.T @ scaled.reshape(-1, n)
            out[:, a, :, b] = block
            out[:, b, :, a] = block.T
    return out.reshape(3 * n, 3 * n)


def _blocks(
    a: int, b: int, m: int, c: Single, bulk: Single, bend: Single | None, f: Single, plain: Single
) -> list[Single]:
    """Entries (a m, b k) of the weighted Hessian of the density at all points, for k = 0, 1, 2."""
    out = []
    for k in range(3):
        entry = bulk * c[a, m] * c[b, k]
        if a == b and m == k:
            entry += plain
        if bend is not None and a != b and m != k:  # dcof[a, m]/dF[b, k] = e(a, b, o) e(m, k, q) F[o, q]
            o, q = 3 - a - b, 3 - m - k
            sign = 1.0 if ((b - a) % 3 == 1) == ((k - m) % 3 == 1) else -1.0
            entry += np.float32(sign) * bend * f[o, q]
        out.append(entry)
    return out


def _scale(out: Single, rows: Single, factors: list[Single]) -> None:
    """out = sum_k factors[k] rows[k], (Q, n)."""
    np.multiply(factors[0][:, None], rows[0], out=out)
    for k in (1, 2):
        out += factors[k][:, None] * rows[k]
