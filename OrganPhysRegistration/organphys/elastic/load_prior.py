"""Prior on the loads that bend the organ: they are few and spread over patches, not everywhere and rough.

What is not seen is decided by the prior. Least elastic energy lets the organ bend next to the data and leaves the rest
as if free; but an organ bends since something presses, pulls or weighs on it. With the displacement u of linear
elasticity the load per volume is f = M^-1 K u, and sum |f|^2 = u K M^-1 K u weighs a mode by the square of its
stiffness instead of the stiffness itself. Most of an organ is not loaded at all and some of it strongly: a heavy-tailed
density, (1 + |f|^2 / m)^(1 - TAIL) with m the median, is met by weights renewed in every outer step (iteratively
reweighted least squares; Holland and Welsch, Communications in Statistics A6, 1977).
"""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array
from .reduced_organ import ReducedOrgan

TAIL = 0.5  # exponent of the weights; 0: Gaussian loads


def load_hessian(organ: ReducedOrgan, z: Array) -> Array:
    """Hessian (12H, 12H) at Z (4H, 3) of the load prior L = 1 / (2 unit) mean_q w_q |f_q|^2, a quadratic in Z.

    f_q = Phi_q K Z, for the whitened basis has the mass matrix I. A mode as stiff as ``organ.load_unit`` costs what it
    costs as elastic energy.
    """
    stiffness, size = organ.rest_hessian, organ.basis.size
    loads = organ.phi_volume @ (stiffness @ z.ravel()).reshape(-1, 3)
    weighted = organ.phi_volume * _weights(loads)[:, None]
    mass = weighted.T @ organ.phi_volume / (len(loads) * organ.load_unit)
    product = np.matmul(mass, stiffness.reshape(size, -1)).reshape(stiffness.shape)
    found: Array = stiffness @ product
    return found


def _weights(loads: Array) -> Array:
    """Weights (Q,) with mean 1, small where the load (Q, 3) is large beside the median."""
    squared = (loads**2).sum(1)
    usual = max(float(np.median(squared)), 1e-12)
    weights: Array = (1 + squared / usual) ** -TAIL
    return weights / weights.mean()
