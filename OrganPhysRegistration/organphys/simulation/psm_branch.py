"""One closed-form solution of the PSM's inverse kinematics, limits not regarded, for many poses at once.

With the hinge at p and its axis along h (both known), the pitch axis of the wrist is perpendicular to h and to the
shaft; the shaft lies in the plane through the RCM, p and h, so the pitch axis is the normal of that plane. This gives
the link between pitch axis and hinge, by it the wrist's centre, by that the shaft, and all six joints. Two signs are
open: of the normal, and whether the wrist is before or behind the RCM.
"""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array
from .instruments import BEHIND_RCM, Instrument

TINY = 1e-9  # m: wrist so near to the RCM that the shaft's direction is open
TURN = 2 * np.pi
NEXT, AFTER = np.array([1, 2, 0]), np.array([2, 0, 1])


def branch(
    rotation: Array, hinge: Array, near: Array, instrument: Instrument, normal_sign: Array, side: Array
) -> Array:
    """Joints (N, 6), limits not regarded but the roll's; side (N,) or (1,) -1: wrist behind the RCM."""
    y5 = -rotation[:, :, 0]  # the axes of frames 4 to 6 as in the table
    z5 = normal_sign[:, None] * unit_normal(hinge, y5)
    x5 = cross(y5, z5)
    wrist = hinge - instrument.wrist_length * x5
    depth = np.sqrt(dot(wrist, wrist))
    z4 = wrist * (side / np.maximum(depth, TINY))[:, None]
    open_shaft = depth < TINY
    if open_shaft.any():
        z4[open_shaft] = _nearest_shaft(near[open_shaft], z5[open_shaft], x5[open_shaft])
    q = np.empty((len(hinge), 6))
    q[:, 0] = np.arctan2(z4[:, 0], -z4[:, 2])
    q[:, 1] = np.arcsin(np.minimum(np.maximum(-z4[:, 1], -1.0), 1.0))
    q[:, 2] = side * depth + BEHIND_RCM
    q[:, 3:] = wrist_joints(q, z4, z5, x5, rotation, near, instrument)
    return q


def wrist_joints(
    q: Array, z4: Array, z5: Array, x5: Array, rotation: Array, near: Array, instrument: Instrument
) -> Array:
    """Roll and wrist (N, 3) by the axes of frames 4 and 5, yaw and pitch as in q (N, 6)."""
    (s1, s2), (c1, c2) = np.sin(q[:, :2]).T, np.cos(q[:, :2]).T
    zx, zy, zz = z5.T
    along_x3 = s2 * (c1 * zz - s1 * zx) - c2 * zy
    along_y3 = -c1 * zx - s1 * zz
    out = np.empty((len(q), 3))
    out[:, 0] = _nearest_turn(np.arctan2(-along_x3, along_y3), near[:, 3], np.radians(instrument.roll))
    out[:, 1] = np.arctan2(dot(x5, cross(z5, z4)), dot(x5, z4))
    z_tool, y_tool = rotation[:, :, 2], rotation[:, :, 1]  # y6 and -x6
    out[:, 2] = np.arctan2(-dot(y_tool, x5), dot(z_tool, x5))
    return out


def unit_normal(direction: Array, y5: Array) -> Array:
    """Unit normal (N, 3) of the plane of a direction (of the hinge, or the shaft) and the hinge's axis.

    Any one perpendicular to the axis where they are parallel.
    """
    normal = cross(direction, y5)
    length = np.sqrt(dot(normal, normal))
    flat = length < TINY
    if flat.any():
        normal[flat] = cross(y5[flat], np.eye(3)[np.abs(y5[flat]).argmin(1)])
        length[flat] = np.sqrt((normal[flat] ** 2).sum(1))
    out: Array = normal / length[:, None]
    return out


def _nearest_shaft(near: Array, z5: Array, x5: Array) -> Array:
    """Shaft direction (N, 3) perpendicular to z5, nearest to that of the joints ``near``, or along x5."""
    given = shaft_direction(near)
    flat = given - dot(given, z5)[:, None] * z5
    length = np.sqrt((flat**2).sum(1))
    straight = length < 1e-6
    flat[straight], length[straight] = x5[straight], 1.0
    out: Array = flat / length[:, None]
    return out


def shaft_direction(joints: Array) -> Array:
    """Direction (N, 3) of the shaft, z of frames 3 and 4, at joints (N, 6)."""
    q1, q2 = joints[:, 0], joints[:, 1]
    return np.stack([np.cos(q2) * np.sin(q1), -np.sin(q2), -np.cos(q2) * np.cos(q1)], axis=1)


def _nearest_turn(roll: Array, near: Array, limit: float) -> Array:
    """The roll (N,), known up to whole turns, nearest to ``near`` (N,) within +-limit (all rad, limit at least pi)."""
    roll = roll + TURN * np.round((near - roll) / TURN)
    roll = roll - TURN * np.ceil(np.maximum(roll - limit, 0.0) / TURN)
    out: Array = roll + TURN * np.ceil(np.maximum(-limit - roll, 0.0) / TURN)
    return out


def cross(a: Array, b: Array) -> Array:
    """Cross product (N, 3); numpy's own takes longer for few rows."""
    out: Array = a.take(NEXT, 1) * b.take(AFTER, 1) - a.take(AFTER, 1) * b.take(NEXT, 1)
    return out


def dot(a: Array, b: Array) -> Array:
    out: Array = np.einsum("ij,ij->i", a, b)
    return out
