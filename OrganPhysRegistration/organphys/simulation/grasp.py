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
from .tools import Jaws

CAUGHT = 0.3  # radii deep


def between_jaws(points: Array, pose: ToolPose, jaws: Jaws) -> NDArray[np.bool_]:
    """(N,) bool: which points (N, 3) of the scene the jaws catch: in the wedge between them or within their reach."""
    x, y, z = ((points - pose.position) @ pose.rotation).T
    opening = np.tan(np.radians(max(pose.jaw_deg, 0.0)) / 2) * np.maximum(z, 0)
    inside: NDArray[np.bool_] = (np.abs(x) <= jaws.half_width) & (z >= 0)
    return inside & (z <= jaws.length + jaws.reach) & (np.abs(y) <= opening + jaws.reach)


def updated_grip(grip: Grip, body: Body, z: Array, near: NDArray[np.int64], pose: ToolPose, jaws: Jaws) -> Grip:
    """The grip for the next step: taken when the jaws have closed, let go when they have opened.

    ``near`` (k,): samples that may lie between the jaws; z (n, 3): coordinates of the body.
    """
    if grip.closed:
        opened = pose.jaw_deg > jaws.open_deg
        return Grip(passing=np.union1d(grip.passing, grip.sample)) if opened else grip
    if pose.jaw_deg > jaws.close_deg:
        return grip
    points = body.sample_positions(z, near)
    held = between_jaws(points, pose, jaws)
    anchor = (points[held] - pose.position) @ pose.rotation
    area = float(body.samples.areas[near[held]].sum())
    return Grip(near[held], anchor, area, closed=True, passing=np.setdiff1d(grip.passing, near[held]))


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


def slipped_grip(grip: Grip, points: Array, pose: ToolPose, jaws: Jaws, stiffness: Array, limit: Array) -> Grip:
    """The grip after a step: anchors of samples at points (k, 3) beyond their limit are drawn after them.

    Samples whose anchor has left the jaws are lost and pass; the jaws stay closed.
    """
    local = (points - pose.position) @ pose.rotation
    offset = local - grip.anchor
    length = np.sqrt((offset**2).sum(1))
    reach = limit / stiffness
    drawn = np.maximum(1 - reach / np.maximum(length, 1e-30), 0.0)
    anchor = grip.anchor + drawn[:, None] * offset
    kept = (drawn == 0) | between_jaws(anchor @ pose.rotation.T + pose.position, pose, jaws)
    passing = np.union1d(grip.passing, grip.sample[~kept])
    return replace(grip, sample=grip.sample[kept], anchor=anchor[kept], passing=passing)


def passing_on(grip: Grip, samples: NDArray[np.int64], gaps: Array, normals: Array, radii: Array, width: float) -> Grip:
    """The grip with passing samples as they are after a step: those that have left the tool push again.

    gaps (P, N) m and normals (P, N, 3) of the tool's parts of radii (P,) m at ``samples`` (N,); left: farther than
    ``width`` m. Tissue still deep inside two parts that press it against each other when a step has ended is caught
    between them, as between jaws near their hinge: pushing on would tear it, so it passes.
    """
    inside = samples[gaps.min(axis=0) < width]
    deep = gaps < -CAUGHT * radii[:, None]
    caught = np.zeros(len(samples), dtype=bool)
    for a, b in zip(*np.triu_indices(len(gaps), 1), strict=True):
        if (normals[a, deep[a]].sum(0) * normals[b, deep[b]].sum(0)).sum() < 0:
            caught |= deep[a] | deep[b]
    if not len(grip.passing) and not caught.any():
        return grip
    return replace(grip, passing=np.union1d(np.intersect1d(grip.passing, inside), samples[caught]))
