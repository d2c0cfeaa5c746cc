"""Grasping: tissue between closing jaws is held by springs that slip above a force limit.

Which samples are held changes only between steps, with a hysteresis in the jaw angle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .body import Body
from .contact_samples import ContactSamples
from .friction import FrictionValue
from .state import Grip, ToolPose
from .tools import Jaws, PlacedPart

CAUGHT = 0.3  # radii deep
EXPELLING = 0.02  # m/s: tissue that was let go inside a tool is pushed out so fast


def between_jaws(points: Array, pose: ToolPose, jaws: Jaws) -> NDArray[np.bool_]:
    """(N,) bool: which points (N, 3) of the scene the jaws catch: in the wedge between them or within their reach."""
    x, y, z = ((points - pose.position) @ pose.rotation).T
    opening = np.tan(np.radians(max(pose.jaw_deg, 0.0)) / 2) * np.maximum(z, 0)
    inside: NDArray[np.bool_] = (np.abs(x) <= jaws.half_width) & (z >= 0)
    return inside & (z <= jaws.length + jaws.reach) & (np.abs(y) <= opening + jaws.reach)


def updated_grip(
    grip: Grip,
    body: Body,
    z: Array,
    near: NDArray[np.int64],
    pose: ToolPose,
    jaws: Jaws,
    parts: tuple[PlacedPart, ...],
    width: float,
) -> Grip:
    """The grip for the next step: taken when the jaws have closed, let go when they have opened.

    ``near`` (k,): samples that may lie between the jaws; z (n, 3): coordinates of the body; ``parts``: those of the
    tool before the step; ``width`` m: within so much tissue is not free of them.
    """
    if grip.closed:
        if pose.jaw_deg <= jaws.open_deg:
            return grip
        points = body.sample_positions(z, grip.sample)
        gaps = np.stack([part.gap_and_normal(points)[0] for part in parts]).min(axis=0)
        return _let_go(Grip(passing=grip.passing, allowed=grip.allowed), grip.sample, gaps, width)
    if pose.jaw_deg > jaws.close_deg:
        return grip
    points = body.sample_positions(z, near)
    held = between_jaws(points, pose, jaws)
    anchor = (points[held] - pose.position) @ pose.rotation
    area = float(body.samples.areas[near[held]].sum())
    free = ~np.isin(grip.passing, near[held])
    return Grip(near[held], anchor, area, True, grip.passing[free], grip.allowed[free])


def _let_go(grip: Grip, samples: NDArray[np.int64], gaps: Array, width: float) -> Grip:
    """The grip with those of ``samples`` (k,), at gaps (k,) m, passing as well that are inside the tool."""
    inside = gaps < 0
    passing = np.union1d(grip.passing, samples[inside])
    allowed = np.zeros(len(passing))
    allowed[np.searchsorted(passing, grip.passing)] = grip.allowed
    allowed[np.searchsorted(passing, samples[inside])] = width - gaps[inside]
    return replace(grip, passing=passing, allowed=allowed)


def allowed_at_anchors(gaps: Array, pose: ToolPose, jaws: Jaws, width: float) -> Array:
    """How deep held tissue may be in the jaws (P, k) m without being pushed: as deep as its anchors.

    gaps (P, k) m: those of the anchors. So jaws that close squeeze what they hold, and tissue that slips is pushed as
    by any tool. While they open again, from ``close_deg`` to ``open_deg``, they push all of it out.
    """
    share = np.clip((jaws.open_deg - pose.jaw_deg) / (jaws.open_deg - jaws.close_deg), 0.0, 1.0)
    allowed: Array = share * np.maximum(width - gaps, 0.0)
    return allowed


def grip_springs(grip: Grip, samples: ContactSamples, jaws: Jaws) -> tuple[Array, Array]:
    """Stiffness (k,) N/m and force limit (k,) N of every held sample: its share of the area that was caught."""
    share = samples.areas[grip.sample] / max(grip.area, 1e-30)
    return jaws.stiffness * share, jaws.force_limit * share


def grip_value(offset: Array, stiffness: Array, limit: Array) -> FrictionValue:
    """Springs of ``stiffness`` (k,) N/m whose force stays at ``limit`` (k,) N, at offsets (k, 3) m from the anchors."""
    length = np.sqrt((offset**2).sum(1))
    reach = limit / stiffness
    slips = length > reach
    energy = np.where(slips, limit * (length - 0.5 * reach), 0.5 * stiffness * length**2)
    pull = np.where(slips, limit / np.maximum(length, 1e-30), stiffness)
    along = offset / np.maximum(length, 1e-30)[:, None]
    bend = np.where(slips, pull, 0.0)[:, None, None] * (along[:, :, None] * along[:, None, :])
    return FrictionValue(float(energy.sum()), pull[:, None] * offset, pull[:, None, None] * np.eye(3) - bend)


def slipped_grip(
    grip: Grip, points: Array, pose: ToolPose, jaws: Jaws, stiffness: Array, limit: Array, gaps: Array, width: float
) -> Grip:
    """The grip after a step: anchors of samples at points (k, 3) beyond their limit are drawn after them.

    Samples whose anchor has left the jaws are lost, and pass if they are inside the tool by their gaps (k,) m; the
    jaws stay closed.
    """
    local = (points - pose.position) @ pose.rotation
    offset = local - grip.anchor
    length = np.sqrt((offset**2).sum(1))
    reach = limit / stiffness
    drawn = np.maximum(1 - reach / np.maximum(length, 1e-30), 0.0)
    anchor = grip.anchor + drawn[:, None] * offset
    kept = (drawn == 0) | between_jaws(anchor @ pose.rotation.T + pose.position, pose, jaws)
    return _let_go(replace(grip, sample=grip.sample[kept], anchor=anchor[kept]), grip.sample[~kept], gaps[~kept], width)


def passing_on(
    grip: Grip, samples: NDArray[np.int64], gaps: Array, normals: Array, radii: Array, width: float, dt: float
) -> Grip:
    """The grip with passing samples as they are after a step of ``dt`` s: once the jaws hold nothing, tissue still in
    them is allowed less and less.

    gaps (P, N) m and normals (P, N, 3) of the tool's parts of radii (P,) m at ``samples`` (N,); free: farther than
    ``width`` m. Tissue still deep inside two parts that press it against each other when a step has ended is caught
    between them, as between jaws near their hinge: pushing on would tear it, so it passes.
    """
    deep = gaps < -CAUGHT * radii[:, None]
    caught = np.zeros(len(samples), dtype=bool)
    for a, b in zip(*np.triu_indices(len(gaps), 1), strict=True):
        if (normals[a, deep[a]].sum(0) * normals[b, deep[b]].sum(0)).sum() < 0:
            caught |= deep[a] | deep[b]
    if not len(grip.passing) and not caught.any():
        return grip
    inside = width - gaps.min(axis=0)
    allowed = np.where(caught, inside, 0.0)
    rows = np.searchsorted(samples, grip.passing)
    shrunk = 0.0 if len(grip.sample) else EXPELLING * dt
    allowed[rows] = np.maximum(allowed[rows], np.minimum(grip.allowed, inside[rows]) - shrunk)
    left = allowed > 0
    return replace(grip, passing=samples[left], allowed=allowed[left])
