"""Coulomb friction as a potential of one step, with the normal forces of the step before.

Li et al., "Incremental Potential Contact", ACM TOG 2020, section 5: mu N f(|u|) of the tangential slip u, with f
smooth below the slip e = slip speed * h: f' = 2 y / e - y^2 / e^2 for y < e, else 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array


class FrictionValue(NamedTuple):
    """Energy in J, its gradient by position (k, 3) in N and positive semi-definite blocks (k, 3, 3) in N/m."""

    energy: float
    gradient: Array
    blocks: Array


def friction(slip: Array, normal: Array, limit: Array, smooth: float) -> FrictionValue:
    """slip (k, 3) m relative to the tool, normal (k, 3), limit (k,) N = mu N, ``smooth`` e in m."""
    tangent = slip - (slip * normal).sum(1, keepdims=True) * normal
    y = np.sqrt((tangent**2).sum(1))
    stick = y < smooth
    share = np.minimum(y / smooth, 1.0)
    energy = np.where(stick, smooth * (share**2 - share**3 / 3 + 1 / 3), y)
    over_y = np.where(stick, (2 - share) / smooth, 1 / np.maximum(y, smooth))  # f'(y) / y
    bend = np.where(stick, 2 * (1 - share) / smooth, 0.0)  # f''(y)
    along = tangent / np.maximum(y, 1e-30)[:, None]
    blocks = over_y[:, None, None] * (np.eye(3) - normal[:, :, None] * normal[:, None, :])
    blocks = blocks + (bend - over_y)[:, None, None] * (along[:, :, None] * along[:, None, :])
    return FrictionValue(float(limit @ energy), (limit * over_y)[:, None] * tangent, limit[:, None, None] * blocks)


def held_back(slip: Array, normal: Array, limit: Array, smooth: float, move: Array) -> tuple[NDArray[np.int64], Array]:
    """Pairs (m,) whose slip (k, 3) a ``move`` (k, 3) would turn round, and what makes their blocks (m, 3, 3) N/m as
    stiff as sticking ones.

    A sliding pair does not resist a further slip along its way, so that Newton's step goes past the place where it
    sticks, and the next one back again. With f'(y) / y along the slip as well, which majorises, the step ends there.
    """
    tangent = slip - (slip * normal).sum(1, keepdims=True) * normal
    y = np.sqrt((tangent**2).sum(1))
    rows = np.flatnonzero((y > 0.5 * smooth) & ((tangent * (tangent + move)).sum(1) < 0))
    share, y = np.minimum(y[rows] / smooth, 1.0), y[rows]
    missing = np.where(share < 1, share / smooth, 1 / np.maximum(y, smooth))  # f'(y) / y - f''(y)
    along = tangent[rows] / y[:, None]
    return rows, (limit[rows] * missing)[:, None, None] * (along[:, :, None] * along[:, None, :])
