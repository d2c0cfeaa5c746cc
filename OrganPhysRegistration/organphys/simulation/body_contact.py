"""Where bodies touch each other: pairs of a surface sample of one and the nearest surface sample of the other.

During a step each pair keeps its partners and the normal at its start: the gap is the distance from the partner's
tangent plane. It costs what a tool's barrier costs, and pushes both alike, so that momentum is kept. Every surface
counts against the other with half of its area. There is no friction: organs slide on each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..ground.checks import Array
from ..mechanics.determinant import cofactor
from .barrier import barrier
from .body import Body
from .options import SimulationOptions
from .state import BodyState

SIDEWAYS = 1.5  # sample spacings: a partner farther beside its sample than this is none
SPARE = 5e-4  # m


class PairValue(NamedTuple):
    """Energy J, gradient (n, 3) N, curvature (N,) N/m along the normals and lowest gap m."""

    energy: float
    gradient: Array
    curvature: Array
    gap: float


@dataclass(frozen=True)
class BodyPairs:
    """N pairs: offset (N, 3) m at rest from partner to sample, phi (N, n) of what moves it for the coordinates of all
    bodies in a row, normal (N, 3) of the partner's surface, areas (N,) m^2."""

    offset: Array
    phi: Array
    normal: Array
    areas: Array
    width: float
    pressure: float

    def value(self, z: Array) -> PairValue:
        """Energy and derivatives at the coordinates Z (n, 3) of all bodies."""
        gap = ((self.offset + self.phi @ z) * self.normal).sum(1)
        energy, slope, curvature = (term * self.areas for term in barrier(gap, self.width, self.pressure))
        gradient = self.phi.T @ (slope[:, None] * self.normal)
        return PairValue(float(energy.sum()), gradient, curvature, float(gap.min(initial=np.inf)))

    def product(self, curvature: Array, change: Array) -> Array:
        """Second derivative times ``change`` (n, 3)."""
        along = curvature * ((self.phi @ change) * self.normal).sum(1)
        return self.phi.T @ (along[:, None] * self.normal)


def body_pairs(
    bodies: tuple[Body, ...], states: tuple[BodyState, ...], options: SimulationOptions, dt: float
) -> BodyPairs | None:
    """All pairs of samples that may touch within a step of ``dt`` s; None if there are none."""
    ends = np.cumsum([0, *(body.basis.size for body in bodies)])
    found = []
    for a, b in combinations(range(len(bodies)), 2):
        travel = sum(_fastest(bodies[k], states[k]) for k in (a, b)) * 1.5 * dt
        within = options.contact_gap + SPARE + travel
        close = _close(bodies[a], states[a], bodies[b], states[b], within)
        if close is not None:
            found += [(a, b, *_partners(bodies, states, a, b, close, within))]
            found += [(b, a, *_partners(bodies, states, b, a, close[::-1], within))]
    found = [pairs for pairs in found if len(pairs[2])]
    if not found:
        return None
    offset, phi, normal, areas = [], [], [], []
    for one, other, mine, theirs, direction in found:
        row = np.zeros((len(mine), ends[-1]))
        row[:, ends[one] : ends[one + 1]] = bodies[one].sample_phi(mine)
        row[:, ends[other] : ends[other + 1]] -= bodies[other].sample_phi(theirs)
        offset.append(bodies[one].samples.points[mine] - bodies[other].samples.points[theirs])
        phi.append(row)
        normal.append(direction)
        areas.append(0.5 * bodies[one].samples.areas[mine])
    return BodyPairs(
        np.concatenate(offset),
        np.concatenate(phi),
        np.concatenate(normal),
        np.concatenate(areas),
        options.contact_gap,
        options.contact_pressure,
    )


def _fastest(body: Body, state: BodyState) -> float:
    return float(np.sqrt(((body.middle_phi @ state.velocity) ** 2).sum(1).max()))


Samples = tuple[NDArray[np.int64], NDArray[np.int64]]


def _close(a: Body, state_a: BodyState, b: Body, state_b: BodyState, within: float) -> Samples | None:
    """Samples of both in patches that come within ``within`` m of a patch of the other."""
    middles = [
        body.samples.points[body.samples.middle] + body.middle_phi @ state.z
        for body, state in ((a, state_a), (b, state_b))
    ]
    reach = [1.5 * float(body.samples.reach.max()) for body in (a, b)]
    near = cKDTree(middles[0]).query_ball_tree(cKDTree(middles[1]), within + sum(reach))
    mine = np.array([k for k, hits in enumerate(near) if hits], dtype=np.int64)
    if not len(mine):
        return None
    theirs = np.unique(np.concatenate([hits for hits in near if hits])).astype(np.int64)
    return a.samples.of_patches(mine), b.samples.of_patches(theirs)


def _partners(
    bodies: tuple[Body, ...], states: tuple[BodyState, ...], one: int, other: int, close: Samples, within: float
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Samples (N,) of ``one``, their partners (N,) on ``other`` and the partners' normals (N, 3)."""
    mine, theirs = close
    x, y = bodies[one].sample_positions(states[one].z, mine), bodies[other].sample_positions(states[other].z, theirs)
    spacing = SIDEWAYS * bodies[other].samples.spacing
    distance, nearest = cKDTree(y).query(x, distance_upper_bound=np.hypot(within, spacing))
    hit = np.flatnonzero(np.isfinite(distance))
    normal = surface_normals(bodies[other], states[other].z, theirs[nearest[hit]])
    offset = x[hit] - y[nearest[hit]]
    gap = (offset * normal).sum(1)
    beside = np.sqrt(np.maximum((offset**2).sum(1) - gap**2, 0.0))
    facing = (surface_normals(bodies[one], states[one].z, mine[hit]) * normal).sum(1) < 0
    kept = (gap < within) & (beside < spacing) & facing
    return mine[hit[kept]], theirs[nearest[hit[kept]]], normal[kept]


def surface_normals(body: Body, z: Array, samples: NDArray[np.int64]) -> Array:
    """Outward unit normals (k, 3) of the deformed surface at contact samples (k,): cof(F) N."""
    rest = body.sample_normals[samples]
    cof = cofactor(body.strain.gradients(z)[:, :, body.sample_cells[samples]])
    normal = np.einsum("amk,km->ka", cof, rest)
    return normal / np.sqrt((normal**2).sum(1))[:, None]
