"""Bodies that touch each other over one (sub-)step: one minimisation for all of them."""

from __future__ import annotations

import numpy as np

from .advance import SEARCHES, BodyReport, Motion, advance, outcome, prepared, with_missed
from .body import Body
from .body_contact import body_pairs
from .factor import FactorCache
from .joint_potential import JointFactors, JointPotential
from .newton_cg import Solved, minimise
from .options import SimulationOptions
from .state import BodyState


def advance_all(
    bodies: tuple[Body, ...],
    states: tuple[BodyState, ...],
    motion: Motion,
    options: SimulationOptions,
    dt: float,
    cache: FactorCache,
    *,
    pieces: int = 1,
) -> list[tuple[BodyState, BodyReport]]:
    """The states of all bodies ``dt`` s later; each by itself while none is near another."""
    pairs = body_pairs(bodies, states, options, dt) if len(bodies) > 1 else None
    if pairs is None:
        return [
            advance(body, state, motion, options, dt, cache, pieces=pieces)
            for body, state in zip(bodies, states, strict=True)
        ]
    ready = [prepared(body, state, motion, options, dt) for body, state in zip(bodies, states, strict=True)]
    factors = JointFactors(cache, tuple(state.reference for state in states))
    for _ in range(SEARCHES):
        joint = JointPotential(tuple(one.potential for one in ready), pairs)
        predicted = np.concatenate([part.scheme.predicted for part in joint.parts])
        present = np.concatenate([one.state.z for one in ready])
        effort = len(bodies) * options.effort // pieces
        solved = minimise(joint, (predicted, present), present, factors, effort=effort)
        more = [with_missed(one, motion, options, at.z) for one, at in zip(ready, solved.at.parts, strict=True)]
        if not any(more):
            break
        ready = [one if other is None else other for one, other in zip(ready, more, strict=True)]
    gap = max(0.0, -solved.at.pairs.gap)
    return [
        outcome(one, motion, Solved(at._replace(gradient=solved.at.gradient[rows]), *solved[1:]), dt, deepest=gap)
        for one, at, rows in zip(ready, solved.at.parts, joint.slices, strict=True)
    ]
