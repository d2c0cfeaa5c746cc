"""Forward kinematics and Jacobian of the PSM by its modified Denavit-Hartenberg table, for many joint vectors at once.

Craig, "Introduction to Robotics", 3rd ed., eq. 3.6: T_(i-1)_i = Rx(alpha) Tx(a) Rz(theta) Tz(d). Frame 0 is the remote
centre of motion (RCM): at joints 0 the shaft points along its -z; yaw moves the tip to +x, pitch to -y.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..ground.checks import Array
from .instruments import DH_ALPHA, DH_D, DH_THETA, PRISMATIC, R_6_TOOL, Instrument

# The shaft's frame is frame 4 turned half a turn about the shaft: with a straight wrist it is the tool frame.
R_4_SHAFT = np.diag([-1.0, -1.0, 1.0])


class Links(NamedTuple):
    """Poses in the RCM frame: rotations (N, 3, 3), positions (N, 3) m.

    tool: origin at the hinge of the jaws, x along it, z to the tip; shaft: origin on the wrist's pitch axis, which is
    its y; z along the shaft to the tip.
    """

    tool_rotation: Array
    hinge: Array
    shaft_rotation: Array
    wrist: Array


def link_frames(joints: Array, instrument: Instrument) -> Array:
    """T_rcm_i (N, 6, 4, 4) of all six frames at joints (N, 6) rad and m."""
    theta = DH_THETA + np.where(PRISMATIC, 0.0, joints)
    d = DH_D + np.where(PRISMATIC, joints, 0.0)
    ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(DH_ALPHA), np.sin(DH_ALPHA)
    step = np.zeros((len(joints), 6, 4, 4))
    step[..., 0, 0], step[..., 0, 1] = ct, -st
    step[..., 1, 0], step[..., 1, 1], step[..., 1, 2], step[..., 1, 3] = st * ca, ct * ca, -sa, -sa * d
    step[..., 2, 0], step[..., 2, 1], step[..., 2, 2], step[..., 2, 3] = st * sa, ct * sa, ca, ca * d
    step[..., 3, 3] = 1.0
    step[:, 5, 0, 3] = instrument.wrist_length
    for i in range(1, 6):
        step[:, i] = step[:, i - 1] @ step[:, i]
    return step


def links(joints: Array, instrument: Instrument) -> Links:
    """Tool and shaft at joints (N, 6)."""
    frames = link_frames(joints, instrument)
    return Links(
        frames[:, 5, :3, :3] @ R_6_TOOL,
        frames[:, 5, :3, 3],
        frames[:, 3, :3, :3] @ R_4_SHAFT,
        frames[:, 4, :3, 3],
    )


def jacobian(joints: Array, instrument: Instrument) -> Array:
    """(N, 6, 6): velocity of the hinge (rows 0-2, m) and angular velocity of the tool (rows 3-5, rad) in the RCM
    frame, per rad or m of each joint (columns); Craig, section 5.
    """
    frames = link_frames(joints, instrument)
    axes = frames[:, :, :3, 2]  # every joint turns about, or slides along, its own frame's z
    arms = frames[:, 5:, :3, 3] - frames[:, :, :3, 3]
    linear = np.where(PRISMATIC[:, None], axes, np.cross(axes, arms))
    angular = np.where(PRISMATIC[:, None], 0.0, axes)
    out: Array = np.concatenate([linear, angular], axis=2).swapaxes(1, 2)
    return out
