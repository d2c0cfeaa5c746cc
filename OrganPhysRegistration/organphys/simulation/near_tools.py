"""Which contact samples of a body a tool may touch during a step, and the contact terms of these."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..mechanics.determinant import cofactor
from .body import Body
from .contact_terms import ContactTerms, Held, Sticking, already_crossed
from .grasp import allowed_at_anchors, grip_springs
from .options import SimulationOptions
from .state import BodyState, Grip, ToolPose
from .tools import PlacedPart, Tool

SURE = 1.3  # a patch may be stretched more than the quadrature points nearest to it
SPARE = 1e-3  # m: tissue may move so much farther than its present velocity says before the search is repeated


class Patches(NamedTuple):
    """Patches (k,) of contact samples, ascending, and how far from their middles their samples may be (k,), m."""

    number: NDArray[np.int64]
    radius: Array


def near_patches(body: Body, z: Array, parts: tuple[PlacedPart, ...], within: float) -> Patches:
    """All patches that may have samples within ``within`` m of a part at Z (n, 3)."""
    stretch = SURE * stretches(body.strain.gradients(z))[body.patch_cells].max(1)
    patches = Patches(np.arange(len(stretch)), stretch * body.samples.reach)
    return _close(patches, body.samples.points[body.samples.middle] + body.middle_phi @ z, parts, within)


def near_samples(
    body: Body, z: Array, parts: tuple[PlacedPart, ...], within: float, patches: Patches | None = None
) -> NDArray[np.int64]:
    """Indices (N,), ascending, of all samples (of some patches) within ``within`` m of a part at Z (n, 3)."""
    if patches is None:
        patches = near_patches(body, z, parts, within)
    else:
        middles = body.samples.points[body.samples.middle[patches.number]] + body.middle_phi[patches.number] @ z
        patches = _close(patches, middles, parts, within)
    samples = body.samples.of_patches(patches.number)
    x = body.sample_positions(z, samples)
    near = np.zeros(len(samples), dtype=bool)
    for part in parts:
        near |= part.gap_and_normal(x)[0] < within
    return samples[near]


def _close(patches: Patches, middles: Array, parts: tuple[PlacedPart, ...], within: float) -> Patches:
    near = np.zeros(len(middles), dtype=bool)
    for part in parts:
        near |= part.gap_and_normal(middles)[0] < within + patches.radius
    return Patches(patches.number[near], patches.radius[near])


def stretches(f: Array) -> Array:
    """Upper bounds (Q,) of the largest stretches of gradients F (3, 3, Q), by s^2 <= tr F^T F - 2 det F / s."""
    trace = (f**2).sum((0, 1))
    determinant = (f[0] * cofactor(f)[0]).sum(0)
    s = np.sqrt(trace)
    for _ in range(6):
        s = np.sqrt(np.maximum(trace - 2 * determinant / s, 0.0))
    return s


def contact_terms(
    body: Body,
    state: BodyState,
    samples: NDArray[np.int64],
    tools: tuple[Tool, ...],
    owner: NDArray[np.int64],
    old: tuple[PlacedPart, ...],
    new: tuple[PlacedPart, ...],
    poses: tuple[ToolPose, ...],
    options: SimulationOptions,
    h: float,
) -> ContactTerms:
    """Contact, friction and grip at ``samples``, which hold all those in the state's grips."""
    surface = body.samples
    points, phi = surface.points[samples], body.sample_phi(samples)
    start = points + phi @ state.z
    held = tuple(
        _held(k, grip, samples, surface_grip, pose)
        for k, (grip, tool, pose) in enumerate(zip(state.grips, tools, poses, strict=True))
        if tool.jaws is not None and len(grip.sample)
        for surface_grip in [grip_springs(grip, surface, tool.jaws)]
    )
    allowed, gripped = _allowed(state, samples, tools, owner, new, poses, options.contact_gap)
    return ContactTerms(
        samples=samples,
        points=points,
        areas=surface.areas[samples],
        phi=phi,
        start=start,
        old=old,
        new=new,
        allowed=allowed,
        gripped=gripped,
        unchecked=(allowed > 0) | already_crossed(old, new, start),
        sticking=_sticking(state, samples, start, owner, old, new, options, h),
        held=held,
        width=options.contact_gap,
        pressure=options.contact_pressure,
    )


def _allowed(
    state: BodyState,
    samples: NDArray[np.int64],
    tools: tuple[Tool, ...],
    owner: NDArray[np.int64],
    parts: tuple[PlacedPart, ...],
    poses: tuple[ToolPose, ...],
    width: float,
) -> tuple[Array, NDArray[np.bool_]]:
    """How deep tissue in or from a grip may be (P, N) m in the parts of its tool, and which pairs are gripped (P, N):
    what it holds, and while it holds anything what has slipped out between the jaws."""
    allowed = np.zeros((len(parts), len(samples)))
    gripped = np.zeros(allowed.shape, dtype=bool)
    for k, (grip, tool, pose) in enumerate(zip(state.grips, tools, poses, strict=True)):
        mine, held = np.flatnonzero(owner == k), np.searchsorted(samples, grip.sample)
        passing = np.ix_(mine, np.searchsorted(samples, grip.passing))
        allowed[passing], gripped[passing] = grip.allowed, bool(len(held))
        if tool.jaws is not None and len(held):
            anchor = grip.anchor @ pose.rotation.T + pose.position
            gaps = np.stack([parts[part].gap_and_normal(anchor)[0] for part in mine])
            allowed[np.ix_(mine, held)] = allowed_at_anchors(gaps, pose, tool.jaws, width)
            gripped[np.ix_(mine, held)] = True
    return allowed, gripped


def _held(tool: int, grip: Grip, samples: NDArray[np.int64], springs: tuple[Array, Array], pose: ToolPose) -> Held:
    anchor = grip.anchor @ pose.rotation.T + pose.position
    return Held(np.searchsorted(samples, grip.sample), anchor, *springs, tool)


def _sticking(
    state: BodyState,
    samples: NDArray[np.int64],
    start: Array,
    owner: NDArray[np.int64],
    old: tuple[PlacedPart, ...],
    new: tuple[PlacedPart, ...],
    options: SimulationOptions,
    h: float,
) -> Sticking:
    """Friction at last step's contacts, as far as their samples are near still.

    Closed jaws that hold something rub on nothing else: what they can pull is the force limit of the grip.
    """
    touch = state.touch
    holding = np.array([bool(len(grip.sample)) for grip in state.grips])
    here = np.isin(touch.sample, samples) & ~holding[owner[touch.part]] & (options.friction > 0)
    row, part = np.searchsorted(samples, touch.sample[here]), touch.part[here]
    motion = np.zeros((len(row), 3))
    for k in np.unique(part):
        mine = part == k
        motion[mine] = new[k].to_scene(old[k].to_local(start[row[mine]])) - start[row[mine]]
    limit = options.friction * touch.force[here]
    return Sticking(row, part, touch.normal[here], limit, motion, options.slip_speed * h)
