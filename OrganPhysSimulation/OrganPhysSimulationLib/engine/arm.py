"""The instrument's motion: joints go towards the wanted ones no faster than a hand would move them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from organphys.ground.checks import Array
from organphys.simulation.psm import Psm, PsmSolution
from organphys.simulation.state import ToolPose

TIP_SPEED = 0.15  # m/s; a brisk movement of a surgeon's hand
TURN_SPEED = np.radians(240)  # rad/s of any joint
JAW_SPEED = 180.0  # deg/s


@dataclass(frozen=True)
class ArmState:
    """joints (6,): rad, the third (insertion) in m; jaw_deg: opening of the jaws."""

    joints: Array
    jaw_deg: float


def wanted_by_pose(psm: Psm, pose: ToolPose, now: ArmState) -> tuple[ArmState, PsmSolution]:
    """The joints that bring the tool to ``pose``, nearest to those of ``now``; and how well that can be done."""
    solution = psm.inverse(pose, near=now.joints)
    return ArmState(solution.joints, solution.jaw_deg), solution


def moved(psm: Psm, now: ArmState, wanted: ArmState, dt: float) -> ArmState:
    """The arm ``dt`` s later, on its way from ``now`` to ``wanted``; all joints arrive together."""
    change = wanted.joints - now.joints
    travel = np.linalg.norm(psm.forward(wanted.joints, 0.0).position - psm.forward(now.joints, 0.0).position)
    slowest = max(travel / TIP_SPEED, np.abs(np.delete(change, 2)).max() / TURN_SPEED, abs(change[2]) / TIP_SPEED)
    share = 1.0 if slowest <= dt else dt / slowest
    jaw = wanted.jaw_deg - now.jaw_deg
    step = float(np.clip(jaw, -JAW_SPEED * dt, JAW_SPEED * dt))
    return ArmState(now.joints + share * change, now.jaw_deg + step)


def arrived(now: ArmState, wanted: ArmState) -> bool:
    """Whether the arm is where it is wanted."""
    return bool(np.allclose(now.joints, wanted.joints, atol=1e-9)) and abs(now.jaw_deg - wanted.jaw_deg) < 1e-9
