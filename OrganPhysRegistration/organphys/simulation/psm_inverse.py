"""Closed-form inverse kinematics of the PSM, for many poses at once.

With the hinge at p and its axis along h (both known), the pitch axis of the wrist is perpendicular to h and to the
shaft; the shaft lies in the plane through the RCM, p and h, so the pitch axis is the normal of that plane. This gives
the link between pitch axis and hinge, by it the wrist's centre, by that the shaft, and all six joints. Two signs are
open: of the normal, and whether the wrist is before or behind the RCM; only with the wrist within 15.6 mm of the RCM
can more than one choice lie inside the limits. The roll, whose range exceeds a turn, is taken nearest to a given one.

Singular: only where the wrist's centre is at the RCM (insertion 15.6 mm: the shaft may point anywhere, it is taken
nearest to the given configuration, else straight) and, behind it, where p is along h. A straight wrist is not singular
in this roll-pitch-yaw wrist: it would be at a wrist pitch of 90 deg, beyond the limits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from .instruments import BEHIND_RCM, Instrument
from .psm_kinematics import Links, links

TINY = 1e-9  # m: wrist so near to the RCM that the shaft's direction is open
SLACK = 1e-9  # rad, m: beyond a limit by rounding
TURN = 2 * np.pi
NEXT, AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])
BRANCHES = np.array([[1.0, 1.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0]])  # signs of the normal and of the side
PER_DEGREE = 1e-3  # m: an error of 1 deg counts as one of 1 mm where a pose is out of reach


def inverse_joints(
    rotation: Array, hinge: Array, near: Array, instrument: Instrument
) -> tuple[Array, NDArray[np.bool_]]:
    """Joints (N, 6) inside the limits and which (N, 6) bool had to be clamped.

    rotation (N, 3, 3), hinge (N, 3) m: the tool in the RCM frame; near (N, 6): configuration to stay near to.
    """
    low, high = instrument.limits.T
    joints = _branch(rotation, hinge, near, instrument, *BRANCHES[0, :, None])
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
    return np.sqrt(_dot(away, away)), angle_between(reached.tool_rotation, rotation)


def angle_between(a: Array, b: Array) -> Array:
    """Angle (N,) in degrees between rotations (N, 3, 3) by |A - B| = 2 sqrt(2) sin(angle / 2): exact when small."""
    apart = (a - b).reshape(-1, 9)
    return np.degrees(2 * np.arcsin(np.minimum(np.sqrt(_dot(apart, apart) / 8), 1.0)))


def _best_branch(rotation: Array, hinge: Array, near: Array, instrument: Instrument) -> tuple[Array, NDArray[np.bool_]]:
    """Of all four branches, clamped, the one with the smallest error, and of equal ones the nearest."""
    count, times = len(hinge), len(BRANCHES)
    normal_sign, side = BRANCHES.repeat(count, 0).T
    rotation, hinge, near = np.tile(rotation, (times, 1, 1)), np.tile(hinge, (times, 1)), np.tile(near, (times, 1))
    joints, clamped = _clamped(_branch(rotation, hinge, near, instrument, normal_sign, side), hinge, instrument)
    away, turn = pose_errors(links(joints, instrument), rotation, hinge)
    cost = np.round((away + PER_DEGREE * turn) / 1e-9).reshape(times, count)
    apart = (joints - near) / instrument.ranges
    best = np.lexsort((_dot(apart, apart).reshape(times, count), cost), axis=0)[0] * count + np.arange(count)
    return joints[best], clamped[best]


def _branch(
    rotation: Array, hinge: Array, near: Array, instrument: Instrument, normal_sign: Array, side: Array
) -> Array:
    """Joints (N, 6), limits not regarded but the roll's; side (N,) or (1,) -1: wrist behind the RCM."""
    y5 = -rotation[:, :, 0]  # the axes of frames 4 to 6 as in the table
    z5 = normal_sign[:, None] * _unit_normal(hinge, y5)
    x5 = _cross(y5, z5)
    wrist = hinge - instrument.wrist_length * x5
    depth = np.sqrt(_dot(wrist, wrist))
    z4 = wrist * (side / np.maximum(depth, TINY))[:, None]
    open_shaft = depth < TINY
    if open_shaft.any():
        z4[open_shaft] = _nearest_shaft(near[open_shaft], z5[open_shaft], x5[open_shaft])
    q = np.empty((len(hinge), 6))
    q[:, 0] = np.arctan2(z4[:, 0], -z4[:, 2])
    q[:, 1] = np.arcsin(np.minimum(np.maximum(-z4[:, 1], -1.0), 1.0))
    q[:, 2] = side * depth + BEHIND_RCM
    (s1, s2), (c1, c2) = np.sin(q[:, :2]).T, np.cos(q[:, :2]).T
    zx, zy, zz = z5.T
    along_x3 = s2 * (c1 * zz - s1 * zx) - c2 * zy
    along_y3 = -c1 * zx - s1 * zz
    q[:, 3] = _nearest_turn(np.arctan2(-along_x3, along_y3), near[:, 3], np.radians(instrument.roll))
    x4 = _cross(z5, z4)
    q[:, 4] = np.arctan2(_dot(x5, x4), _dot(x5, z4))
    z_tool, y_tool = rotation[:, :, 2], rotation[:, :, 1]  # y6 and -x6
    q[:, 5] = np.arctan2(-_dot(y_tool, x5), _dot(z_tool, x5))
    return q


def _clamped(joints: Array, hinge: Array, instrument: Instrument) -> tuple[Array, NDArray[np.bool_]]:
    """Joints inside the limits and which were not; where the wrist was, the arm still brings the hinge to its place."""
    low, high = instrument.limits.T
    outside = (joints < low - SLACK) | (joints > high + SLACK)
    joints = np.clip(joints, low, high)
    bent = outside[:, 4]
    if bent.any():
        aimed = _aimed(joints[bent], hinge[bent], instrument)
        outside[bent, :3] |= (aimed < low[:3] - SLACK) | (aimed > high[:3] + SLACK)
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


def _unit_normal(hinge: Array, y5: Array) -> Array:
    """Unit normal (N, 3) of the plane of hinge position and hinge axis; any one where they are parallel."""
    normal = _cross(hinge, y5)
    length = np.sqrt(_dot(normal, normal))
    flat = length < TINY
    if flat.any():
        normal[flat] = _cross(y5[flat], np.eye(3)[np.abs(y5[flat]).argmin(1)])
        length[flat] = np.sqrt((normal[flat] ** 2).sum(1))
    out: Array = normal / length[:, None]
    return out


def _nearest_shaft(near: Array, z5: Array, x5: Array) -> Array:
    """Shaft direction (N, 3) perpendicular to z5, nearest to that of the joints ``near``, or along x5."""
    q1, q2 = near[:, 0], near[:, 1]
    given = np.stack([np.cos(q2) * np.sin(q1), -np.sin(q2), -np.cos(q2) * np.cos(q1)], axis=1)
    flat = given - _dot(given, z5)[:, None] * z5
    length = np.sqrt((flat**2).sum(1))
    straight = length < 1e-6
    flat[straight], length[straight] = x5[straight], 1.0
    out: Array = flat / length[:, None]
    return out


def _nearest_turn(roll: Array, near: Array, limit: float) -> Array:
    """The roll (N,), known up to whole turns, nearest to ``near`` (N,) within +-limit (all rad, limit at least pi)."""
    roll = roll + TURN * np.round((near - roll) / TURN)
    roll = roll - TURN * np.ceil(np.maximum(roll - limit, 0.0) / TURN)
    out: Array = roll + TURN * np.ceil(np.maximum(-limit - roll, 0.0) / TURN)
    return out


def _cross(a: Array, b: Array) -> Array:
    """Cross product (N, 3); numpy's own takes longer for few rows."""
    out: Array = a.take(NEXT, 1) * b.take(AFTER, 1) - a.take(AFTER, 1) * b.take(NEXT, 1)
    return out


def _dot(a: Array, b: Array) -> Array:
    out: Array = np.einsum("ij,ij->i", a, b)
    return out
