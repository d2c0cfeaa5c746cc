"""Trajectories as poses of a simulated tool, and whether an arm can follow them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..ground.checks import Array, InputError
from ..ground.notices import Notice, plain_number
from ..points.trajectory import Trajectory
from .instruments import JOINTS
from .psm import Psm, PsmPath
from .state import ToolPose

NAMES = (*JOINTS, "jaw")
NEAR_TROCAR = 0.005  # m


def tool_poses(trajectory: Trajectory, tip_length: float) -> tuple[ToolPose, ...]:
    """Poses of a tool whose jaws are ``tip_length`` m long: its frame is at the hinge, the trajectory is of the tip.

    The trajectory must be in metres, see ``Trajectory.in_metres``.
    """
    rotations, hinges = _hinges(trajectory, tip_length)
    rows = zip(hinges, rotations, trajectory.jaw_deg, strict=True)
    return tuple(ToolPose(position, rotation, float(jaw)) for position, rotation, jaw in rows)


def tip_trajectory(times: ArrayLike, poses: Sequence[ToolPose], tip_length: float) -> Trajectory:
    """The other way round: times (T,) s and poses of the tool as a trajectory of its tip, in metres."""
    rotations = np.stack([pose.rotation for pose in poses])
    tips = np.stack([pose.position for pose in poses]) + tip_length * rotations[:, :, 2]
    return Trajectory(np.asarray(times), tips, rotations, np.array([pose.jaw_deg for pose in poses]), "m", "m")


@dataclass(frozen=True)
class Reach:
    """How an arm follows a trajectory of T poses.

    times (T,) s; path: joints and errors of every pose; poses: those the arm takes, limits kept; near_trocar (T,)
    bool: the wrist is so near to the trocar (5 mm) that small motions need large turns of the arm.
    """

    times: Array
    path: PsmPath
    poses: tuple[ToolPose, ...]
    near_trocar: NDArray[np.bool_]

    @property
    def clamped(self) -> NDArray[np.bool_]:
        """(T,) bool: poses where a joint or the jaw was stopped by its limit."""
        hit: NDArray[np.bool_] = np.any(self.path.clamped, axis=1)
        return hit

    def limits(self, frame: int) -> tuple[str, ...]:
        """Names of the joints, and "jaw", that were stopped at that pose."""
        return tuple(NAMES[k] for k in np.flatnonzero(self.path.clamped[frame]))

    def notices(self) -> tuple[Notice, ...]:
        """What the user should know; empty where the arm follows exactly."""
        out = []
        if self.clamped.any():
            frames = np.flatnonzero(self.clamped)
            names = ", ".join(NAMES[k].replace("_", " ") for k in np.flatnonzero(np.any(self.path.clamped, axis=0)))
            away, turned = 1e3 * self.path.position_error_m.max(), self.path.rotation_error_deg.max()
            text = (
                f"{len(frames)} of {len(self.times)} poses are beyond a limit ({names}) and were clamped, the first at "
                f"{plain_number(self.times[frames[0]])} s; the tool is up to {plain_number(away)} mm and "
                f"{plain_number(turned)} deg off"
            )
            out.append(Notice("psm_limits", text))
        if self.path.jumps.any():
            at = self.times[self.path.jumps.argmax()]
            out.append(
                Notice("psm_roll", f"the roll reaches its limit and turns back by 360 deg at {plain_number(at)} s")
            )
        if self.near_trocar.any():
            at = self.times[self.near_trocar.argmax()]
            text = f"the wrist is within 5 mm of the trocar at {plain_number(at)} s: the arm may turn fast there"
            out.append(Notice("psm_singular", text))
        return tuple(out)


def reachable(psm: Psm, trajectory: Trajectory, *, near: ArrayLike | None = None) -> Reach:
    """Follow a trajectory in metres (``Trajectory.in_metres``) with an arm; poses beyond its limits are clamped.

    near: joints (6,) to start from, the middle of their ranges if not given.
    """
    rotations, hinges = _hinges(trajectory, psm.instrument.jaw_length)
    path = psm.inverse_path(rotations, hinges, trajectory.jaw_deg, near=near)
    poses = psm.poses(path.joints, path.jaw_deg)
    return Reach(trajectory.times, path, poses, np.abs(psm.wrist_depth(path.joints)) < NEAR_TROCAR)


def _hinges(trajectory: Trajectory, tip_length: float) -> tuple[Array, Array]:
    if trajectory.frame != "m" or trajectory.unit != "m":
        raise InputError("trajectory: expected in metres of the simulation; convert it with in_metres first")
    return trajectory.rotations, trajectory.positions - tip_length * trajectory.rotations[:, :, 2]
