"""Radius of the ball that holds a point's error with a given probability."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri, fdtri

from ..ground.checks import Array, InputError


def error_radius(covariance: Array, probability: float, *, freedom: float = np.inf) -> Array:
    """Quantile (N,) of the length |e| of errors with zero mean and covariance (N, 3, 3), in the root of its unit.

    e is Gaussian (``freedom`` inf) or Student t with more than 2 degrees of freedom, whose covariance is the given one.
    |e|^2 is matched in its first two moments by g chi^2_h with g h = tr S, h = (tr S)^2 / tr S^2 (Satterthwaite,
    Biometrics Bulletin 2 (1946) 110; Box, Ann. Math. Stat. 25 (1954) 290), for Student t by tr S F(h, freedom). Exact
    where one or all three eigenvalues carry the variance, else the probability is met within 0.025.
    """
    if not 0 < probability < 1:
        raise InputError(f"probability: expected a number between 0 and 1, got {probability}")
    if not freedom > 2:
        raise InputError(f"degrees of freedom: expected more than 2, got {freedom}")
    first = np.trace(covariance, axis1=1, axis2=2)
    second = np.einsum("nab,nab->n", covariance, covariance)
    h = np.clip(first**2 / np.maximum(second, 1e-300), 1.0, 3.0)
    if np.isinf(freedom):
        ratio = chdtri(h, 1 - probability) / h
    else:
        ratio = fdtri(h, freedom, probability) * (freedom - 2) / freedom
    found: Array = np.sqrt(np.maximum(first, 0.0) * ratio)
    return found
