"""Closed-form inverse kinematics of the PSM: the choice of the solution, joint limits, errors; many poses at once.

Of the four branches (see ``psm_branch``) only with the wrist within 15.6 mm of the RCM can more than one lie inside the
limits: then that nearest to a given configuration is taken. The roll, whose range exceeds a turn, is taken nearest to
the given one as well.

Singular: only where the wrist's centre is at the RCM (insertion 15.6 mm: the shaft may point anywhere, it is taken
nearest to the given configuration, else straight) and, behind it, where p is along h. A straight wrist is not singular
in this roll-pitch-yaw wrist: it would be at a wrist pitch of 90 deg, beyond the limits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.frames import rotation_angle
from .instruments import BEHIND_RCM, Instrument
from .psm_branch import TINY, TURN, branch, cross, dot, shaft_direction, unit_normal, wrist_joints
from .psm_kinematics import Links, links

SLACK = 1e-9  # rad, m: beyond a limit by rounding
BRANCHES = np.array([[1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]])  # signs of the normal and of the side
PER_DEGREE = 1e-4  # m: place goes before direction: 10 deg off count as 1 mm off where a pose is out of reach


def inverse_joints(
    rotation: Array, hinge: Array, near: Array, instrument: Instrument
) -> tuple[Array, NDArray[np.bool_]]:
    """Joints (N, 6) inside the limits and which (N, 6) bool had to be clamped.

    rotation (N, 3, 3), hinge (N, 3) m: the tool in the RCM frame; near (N, 6): configuration to stay near to.
    """
    low, high = instrument.limits.T
    joints = branch(rotation, hinge, near, instrument, *BRANCHES[0, :, None])
    outside = (joints < low - SLACK) | (joints > high + SLACK)
    odd = np.flatnonzero(outside.any(1) | (joints[:, 2] < 2 * BEHIND_RCM + SLACK))
    clamped = np.zeros(joints.shape, dtype=bool)
    joints = np.minimum(np.maximum(joints, low), high)
    if len(odd):
        joints[odd], clamped[odd] = _best_branch(rotation[odd], hinge[odd], near[odd], instrument)
    return joints, clamped


def pose_errors(reached: Links, rotation: Array, hinge: Array) -> tuple[Array, Array]:
    """Distance (N,) m of the hinge and angle (N,) deg of the tool from the wanted pose in the RCM frame."""
    away = reached.hinge - hinge
    return np.sqrt(dot(away, away)), np.degrees(rotation_angle(reached.tool_rotation, rotation))


def _best_branch(rotation: Array, hinge: Array, near: Array, instrument: Instrument) -> tuple[Array, NDArray[np.bool_]]:
    """Of all four branches, clamped, the one with the smallest error, and of equal ones the nearest."""
    count, times = len(hinge), len(BRANCHES)
    normal_sign, side = BRANCHES.repeat(count, 0).T
    rotation, hinge, near = np.tile(rotation, (times, 1, 1)), np.tile(hinge, (times, 1)), np.tile(near, (times, 1))
    joints = branch(rotation, hinge, near, instrument, normal_sign, side)
    joints, clamped = _clamped(joints, rotation, hinge, near, instrument)
    away, turn = pose_errors(links(joints, instrument), rotation, hinge)
    cost = np.round((away + PER_DEGREE * turn) / 1e-9).reshape(times, count)
    apart = (joints - near) / instrument.ranges
    best = np.lexsort((dot(apart, apart).reshape(times, count), cost), axis=0)[0] * count + np.arange(count)
    return joints[best], clamped[best]


def _clamped(
    joints: Array, rotation: Array, hinge: Array, near: Array, instrument: Instrument
) -> tuple[Array, NDArray[np.bool_]]:
    """Joints inside the limits and which were not.

    Where the arm is stopped, the wrist still turns the tool as wanted; where only the wrist is, the arm still brings
    the hinge to its place.
    """
    low, high = instrument.limits.T
    outside = (joints < low - SLACK) | (joints > high + SLACK)
    joints = np.clip(joints, low, high)
    short = np.flatnonzero(outside[:, :2].any(1))
    if len(short):
        z4, y5 = shaft_direction(joints[short]), -rotation[short, :, 0]
        z5 = unit_normal(z4, y5)
        wrist = wrist_joints(joints[short], z4, z5, cross(y5, z5), rotation[short], near[short], instrument)
        outside[short, 3:] = (wrist < low[3:] - SLACK) | (wrist > high[3:] + SLACK)
        joints[short, 3:] = np.clip(wrist, low[3:], high[3:])
    bent = np.flatnonzero(outside[:, 4] & ~outside[:, :3].any(1))
    if len(bent):
        aimed = _aimed(joints[bent], hinge[bent], instrument)
        outside[bent, :3] = (aimed < low[:3] - SLACK) | (aimed > high[:3] + SLACK)
        joints[bent, :3] = np.clip(aimed, low[:3], high[:3])
    return joints, outside


def _aimed(joints: Array, hinge: Array, instrument: Instrument) -> Array:
    """Yaw, pitch, insertion (N, 3) that bring the hinge to its place with roll and wrist as they are."""
    s4, c4, s5, c5 = np.sin(joints[:, 3]), np.cos(joints[:, 3]), np.sin(joints[:, 4]), np.cos(joints[:, 4])
    a = instrument.wrist_length
    vx, vy = a * s5 * c4, a * s5 * s4  # the hinge seen from the shaft
    vz = np.sqrt(np.maximum((hinge**2).sum(1) - (a * s5) ** 2, 0.0))
    sine = np.clip(-hinge[:, 1] / np.maximum(np.hypot(vx, vz), TINY), -1.0, 1.0)
    q2 = np.arcsin(sine) - np.arctan2(vx, vz)
    across = vx * np.sin(q2) - vz * np.cos(q2)
    q1 = np.arctan2(-hinge[:, 0], hinge[:, 2]) - np.arctan2(vy, across)
    q1 = (q1 + np.pi) % TURN - np.pi
    return np.stack([q1, q2, vz - a * c5 + BEHIND_RCM], axis=1)
