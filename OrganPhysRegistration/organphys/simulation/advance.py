"""One body over one (sub-)step: near samples, grips, the minimisation, and what the tools feel of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.solve_report import SolveReport
from ..mechanics.determinant import cofactor
from .body import Body
from .factor import FactorCache, renewed
from .grasp import grip_springs, passing_on, slipped_grip, updated_grip
from .incremental_potential import IncrementalPotential
from .near_tools import contact_terms, near_samples
from .newton_cg import Solved, minimise
from .options import SimulationOptions
from .state import BodyState, Grip, ToolPose, Touch
from .time_scheme import SchemeStep, scheme_step
from .tool_force import ToolForce, tool_forces
from .tool_reach import SURE, ToolReach, expected_way, farthest
from .tools import PlacedPart, Tool, place, placed

LEAST_EFFORT = 12  # of a sub-step, beside
OVERHEAD = 10  # Hessian products take as long as the search for near samples and what else comes with a sub-step
SEARCHES = 4  # rounds of the search for near samples, should the tissue have moved farther than expected


@dataclass(frozen=True)
class Motion:
    """Tools with their poses at the start and the end of the step, and the owner (P,) of each of their parts."""

    tools: tuple[Tool, ...]
    before: tuple[ToolPose, ...]
    after: tuple[ToolPose, ...]
    owner: NDArray[np.int64]

    @cached_property
    def old(self) -> tuple[PlacedPart, ...]:
        """All parts of all tools at the start."""
        return placed(self.tools, self.before)

    @cached_property
    def new(self) -> tuple[PlacedPart, ...]:
        """All parts of all tools at the end."""
        return placed(self.tools, self.after)


@dataclass(frozen=True)
class BodyReport:
    """How one body's (sub-)step went.

    solve: why the solver stopped, residual relative to the largest force; cg_steps: conjugate gradient steps;
    error_m: bound of the rms error of the positions from stopping there, m, where the energy is convex; min_det,
    volume_change: lowest det F and mean det F - 1 over the quadrature points; deepest_m: largest penetration of a
    contact sample into a tool or another body, m (0: none), of what jaws hold only as far as it is deeper than where
    it is held; contacts: samples pushed by a tool; forces: on each tool; effort: what it cost, see
    ``SimulationOptions``.
    """

    solve: SolveReport
    cg_steps: int
    error_m: float
    min_det: float
    volume_change: float
    deepest_m: float
    contacts: int
    forces: tuple[ToolForce, ...]
    effort: int


def advance(
    body: Body,
    state: BodyState,
    motion: Motion,
    options: SimulationOptions,
    dt: float,
    cache: FactorCache,
    reach: ToolReach,
    *,
    effort: int,
) -> tuple[BodyState, BodyReport]:
    """The body's state ``dt`` s later, for about ``effort``; ``reach``: what tools may touch in the whole step."""
    ready, spent, most = prepared(body, state, motion, options, dt, reach), 0, int(effort / body.dearness)
    for _ in range(SEARCHES):
        starts = (ready.potential.scheme.predicted, ready.state.z)
        solved = minimise(ready.potential, starts, state.reference, cache, effort=max(most - spent, LEAST_EFFORT))
        spent += solved.effort
        more = with_missed(ready, motion, options, solved.at.z)
        if more is None:
            break
        ready = more
    return outcome(ready, motion, solved._replace(effort=round(spent * body.dearness)), dt)


class Ready(NamedTuple):
    """A body before a step: its state with the grips of the step, the potential, samples (N,) that tools may touch
    while no tissue moves farther than ``spare`` m."""

    state: BodyState
    potential: IncrementalPotential
    samples: NDArray[np.int64]
    spare: float


def prepared(
    body: Body, state: BodyState, motion: Motion, options: SimulationOptions, dt: float, reach: ToolReach
) -> Ready:
    """What a step of one body needs."""
    spare = expected_way(body, state, dt)
    samples = _near(body, state, motion, options.contact_gap + spare, reach)
    state = replace(state, grips=_grips(body, state, samples, motion, options.contact_gap))
    scheme = scheme_step(options.scheme, state, dt)
    return Ready(state, _potential(body, state, motion, options, scheme, samples), samples, spare)


def _potential(
    body: Body,
    state: BodyState,
    motion: Motion,
    options: SimulationOptions,
    scheme: SchemeStep,
    samples: NDArray[np.int64],
) -> IncrementalPotential:
    terms = None
    if len(samples):
        terms = contact_terms(
            body, state, samples, motion.tools, motion.owner, motion.old, motion.new, motion.after, options, scheme.h
        )
    return IncrementalPotential.of_step(body, options, scheme, terms)


def with_missed(ready: Ready, motion: Motion, options: SimulationOptions, z: Array) -> Ready | None:
    """The same with samples that have come near a tool farther than expected at Z (n, 3); None: there are none."""
    body = ready.potential.body
    if not motion.new or SURE * farthest(body, z - ready.state.z) < ready.spare:
        return None
    missed = np.setdiff1d(near_samples(body, z, motion.new, options.contact_gap), ready.samples)
    if not len(missed):
        return None
    samples = np.union1d(ready.samples, missed)
    return ready._replace(
        samples=samples,
        potential=_potential(body, ready.state, motion, options, ready.potential.scheme, samples),
    )


def _near(body: Body, state: BodyState, motion: Motion, within: float, reach: ToolReach) -> NDArray[np.int64]:
    """Samples that a tool may touch, and those it holds or has just held."""
    parts = (*motion.old, *motion.new)
    if not parts:
        return np.zeros(0, dtype=np.int64)
    patches = reach.patches if reach.covers(body, state.z, within) else None
    near = near_samples(body, state.z, parts, within, patches)
    kept = [samples for grip in state.grips for samples in (grip.sample, grip.passing)]
    return np.unique(np.concatenate([near, *kept]))


def _grips(body: Body, state: BodyState, samples: NDArray[np.int64], motion: Motion, width: float) -> tuple[Grip, ...]:
    parts = [place(tool, pose) for tool, pose in zip(motion.tools, motion.before, strict=True)]
    return tuple(
        grip if tool.jaws is None else updated_grip(grip, body, state.z, samples, pose, tool.jaws, old, width)
        for grip, tool, pose, old in zip(state.grips, motion.tools, motion.after, parts, strict=True)
    )


def outcome(
    ready: Ready, motion: Motion, solved: Solved, dt: float, *, deepest: float = 0.0
) -> tuple[BodyState, BodyReport]:
    """State and report of a body after its step has been solved; ``deepest`` m: what it is in another body."""
    state, potential = ready.state, ready.potential
    body, terms, scheme = potential.body, potential.contact, potential.scheme
    at, velocity = solved.at, (solved.at.z - scheme.old) / scheme.h
    touch, forces = Touch(), tuple(ToolForce.none() for _ in motion.tools)
    grips = state.grips
    if terms is not None and at.contact is not None:
        part, row = np.nonzero(at.contact.press > 0)
        touch = Touch(terms.samples[row], part, at.contact.press[part, row], at.contact.normals[part, row])
        forces = tuple(tool_forces(terms, at.contact, at.z, motion.after, motion.owner))
        gaps, normals = terms.gaps(terms.positions(at.z))
        deepest = max(deepest, terms.deepest(gaps))
        radii = np.array([part.shape.radius for part in terms.new])
        grips = tuple(
            passing_on(grip, terms.samples, gaps[mine], normals[mine], radii[mine], terms.width, dt)
            for k, grip in enumerate(_slipped(ready, motion, at.z, gaps))
            for mine in [motion.owner == k]
        )
    f = at.deformation
    determinants = (f[0] * cofactor(f)[0]).sum(0)
    weights = body.strain.weights
    report = BodyReport(
        solved.report,
        solved.cg_steps,
        float(np.linalg.norm(at.gradient)) * scheme.h**2 / body.mass,
        float(determinants.min()),
        float(weights @ determinants / weights.sum()) - 1,
        deepest,
        len(touch.sample),
        forces,
        solved.effort,
    )
    reference, excess = renewed(state.reference, state.excess, at.z, solved.cg_steps)
    new = BodyState(at.z, velocity, state.z, state.velocity, reference, excess, dt, touch, grips)
    return new, report


def _slipped(ready: Ready, motion: Motion, z: Array, gaps: Array) -> tuple[Grip, ...]:
    """Grips after the step; gaps (P, N) m of all near samples."""
    out, body, width = [], ready.potential.body, ready.potential.options.contact_gap
    for k, (grip, tool, pose) in enumerate(zip(ready.state.grips, motion.tools, motion.after, strict=True)):
        if tool.jaws is not None and len(grip.sample):
            springs = grip_springs(grip, body.samples, tool.jaws)
            points = body.sample_positions(z, grip.sample)
            nearest = gaps[motion.owner == k][:, np.searchsorted(ready.samples, grip.sample)].min(axis=0)
            grip = slipped_grip(grip, points, pose, tool.jaws, *springs, nearest, width)
        out.append(grip)
    return tuple(out)
