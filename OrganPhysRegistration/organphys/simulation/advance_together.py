"""Bodies that touch each other over one (sub-)step: one minimisation for all of them."""

from __future__ import annotations

import numpy as np

from .advance import LEAST_EFFORT, SEARCHES, BodyReport, Motion, advance, outcome, prepared, with_missed
from .body import Body
from .body_contact import body_pairs
from .factor import FactorCache
from .joint_potential import JointFactors, JointPotential
from .newton_cg import Solved, minimise
from .options import SimulationOptions
from .state import BodyState
from .tool_reach import ToolReach


def advance_all(
    bodies: tuple[Body, ...],
    states: tuple[BodyState, ...],
    motion: Motion,
    options: SimulationOptions,
    dt: float,
    cache: FactorCache,
    reaches: tuple[ToolReach, ...],
    *,
    effort: int,
) -> list[tuple[BodyState, BodyReport]]:
    """The states of all bodies ``dt`` s later, for about ``effort`` each; each by itself while none is near another.

    ``reaches``: what tools may touch of each in the whole step.
    """
    pairs = body_pairs(bodies, states, options, dt) if len(bodies) > 1 else None
    if pairs is None:
        return [
            advance(body, state, motion, options, dt, cache, reach, effort=effort)
            for body, state, reach in zip(bodies, states, reaches, strict=True)
        ]
    ready = [
        prepared(body, state, motion, options, dt, reach)
        for body, state, reach in zip(bodies, states, reaches, strict=True)
    ]
    factors, spent = JointFactors(cache, tuple(state.reference for state in states)), 0
    dearness = max(body.dearness for body in bodies)
    most = int(effort / dearness)
    for _ in range(SEARCHES):
        joint = JointPotential(tuple(one.potential for one in ready), pairs)
        predicted = np.concatenate([part.scheme.predicted for part in joint.parts])
        present = np.concatenate([one.state.z for one in ready])
        solved = minimise(joint, (predicted, present), present, factors, effort=max(most - spent, LEAST_EFFORT))
        spent += solved.effort
        more = [with_missed(one, motion, options, at.z) for one, at in zip(ready, solved.at.parts, strict=True)]
        if not any(more):
            break
        ready = [one if other is None else other for one, other in zip(ready, more, strict=True)]
    gap, solved = max(0.0, -solved.at.pairs.gap), solved._replace(effort=round(spent * dearness))
    return [
        outcome(one, motion, Solved(at._replace(gradient=solved.at.gradient[rows]), *solved[1:]), dt, deepest=gap)
        for one, at, rows in zip(ready, solved.at.parts, joint.slices, strict=True)
    ]
