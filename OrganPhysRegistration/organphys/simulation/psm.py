"""The da Vinci patient side manipulator: an instrument on an arm that turns about its trocar.

Scene frame, metres. The arm has six joints and the tool's pose six degrees of freedom, so every pose inside the limits
is reached exactly; beyond them the joints are clamped and the remaining error is told.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from .instruments import BEHIND_RCM, INSTRUMENTS, JOINTS, Instrument
from .psm_inverse import inverse_joints, pose_errors
from .psm_kinematics import Links, jacobian, links
from .psm_meshes import PlacedMesh, psm_meshes
from .psm_tool import psm_tool
from .psm_trocar import default_trocar
from .state import ToolPose
from .tools import Tool, checked_pose

__all__ = ["INSTRUMENTS", "Instrument", "PlacedMesh", "Psm", "PsmPath", "PsmSolution", "default_trocar"]

SLACK_DEG = 1e-7  # beyond a jaw limit by rounding


@dataclass(frozen=True)
class PsmSolution:
    """joints (6,) rad and m; pose: the tool as reached; limits: names of the joints (and "jaw") that were clamped.

    position_error_m, rotation_error_deg: between the wanted pose and the reached one.
    """

    joints: Array
    jaw_deg: float
    pose: ToolPose
    position_error_m: float
    rotation_error_deg: float
    limits: tuple[str, ...]


class PsmPath(NamedTuple):
    """Solutions of T poses in a row: joints (T, 6), jaw_deg (T,), errors (T,) as in ``PsmSolution``.

    clamped (T, 7) bool: which of the joints and the jaw; jumps (T,) bool: the roll had to turn back by a whole turn
    since the pose before.
    """

    joints: Array
    jaw_deg: Array
    position_error_m: Array
    rotation_error_deg: Array
    clamped: NDArray[np.bool_]
    jumps: NDArray[np.bool_]


@dataclass(frozen=True)
class Psm:
    """An instrument whose remote centre of motion stands at T_scene_rcm (4, 4), a rigid motion in metres."""

    instrument: Instrument
    T_scene_rcm: Array

    def __post_init__(self) -> None:
        rigid = Similarity.of_matrix(self.T_scene_rcm)
        if abs(rigid.scale - 1) > 1e-6:
            raise InputError(f"T_scene_rcm: expected a rigid motion in metres, got one with scale {rigid.scale:g}")
        object.__setattr__(self, "T_scene_rcm", Similarity(1.0, rigid.rotation, rigid.translation).matrix)

    @property
    def rcm(self) -> Array:
        """The remote centre of motion (3,), m: the trocar."""
        position: Array = self.T_scene_rcm[:3, 3]
        return position

    @property
    def home(self) -> Array:
        """Joints (6,) of the straight, half inserted instrument."""
        return self.instrument.home

    def forward(self, joints: ArrayLike, jaw_deg: float) -> ToolPose:
        """The tool's pose at joints (6,) rad and m; limits are not applied. InputError if not finite."""
        return self.poses(as_joints(joints)[None], np.array([jaw_deg]))[0]

    def poses(self, joints: Array, jaw_deg: Array) -> tuple[ToolPose, ...]:
        """The poses at joints (T, 6) and jaw_deg (T,)."""
        if not (np.isfinite(joints).all() and np.isfinite(jaw_deg).all()):
            raise InputError("joints, jaw_deg: expected finite numbers")
        return self._in_scene(links(joints, self.instrument), jaw_deg)

    @staticmethod
    def wrist_depth(joints: Array) -> Array:
        """How far the wrist's pitch axis is inside the trocar at joints (T, 6), (T,) m; singular at 0."""
        depth: Array = joints[:, 2] - BEHIND_RCM
        return depth

    def jacobian(self, joints: ArrayLike) -> Array:
        """(6, 6) in the scene's axes: hinge velocity (m) and angular velocity (rad) per rad or m of each joint."""
        turn = np.kron(np.eye(2), self.T_scene_rcm[:3, :3])
        out: Array = turn @ jacobian(as_joints(joints)[None], self.instrument)[0]
        return out

    def inverse(self, pose: ToolPose, *, near: ArrayLike | None = None) -> PsmSolution:
        """Joints for a pose of the tool (its shaft is not asked for); of several the nearest to joints ``near`` (6,).

        ``near`` None: nearest to the middle of the ranges. InputError for numbers that are not finite.
        """
        pose = checked_pose(ToolPose(pose.position, pose.rotation, pose.jaw_deg), "tool pose")
        start = self.home if near is None else as_joints(near)
        rotation, hinge = self._in_rcm(pose.rotation[None], pose.position[None])
        joints, clamped = inverse_joints(rotation, hinge, start[None], self.instrument)
        return self.solutions(joints, clamped, rotation, hinge, np.array([pose.jaw_deg]))[0]

    def solutions(
        self, joints: Array, clamped: NDArray[np.bool_], rotation: Array, hinge: Array, jaw_deg: Array
    ) -> tuple[PsmSolution, ...]:
        """What joints (N, 6), clamped (N, 6) as said, make of wanted poses in the RCM frame and openings (N,)."""
        reached = links(joints, self.instrument)
        away, angle = pose_errors(reached, rotation, hinge)
        jaw, beyond = self._jaw(jaw_deg)
        rows = zip(joints, self._in_scene(reached, jaw), away, angle, clamped, beyond, strict=True)
        return tuple(
            PsmSolution(q, at.jaw_deg, at, float(mm), float(deg), _names((*hit, jaw_hit)))
            for q, at, mm, deg, hit, jaw_hit in rows
        )

    def inverse_path(
        self, rotations: Array, positions: Array, jaw_deg: Array, *, near: ArrayLike | None = None
    ) -> PsmPath:
        """Joints for poses in a row: rotations (T, 3, 3), positions (T, 3) m, jaw_deg (T,).

        The roll goes on from pose to pose; where the wrist is within 15.6 mm of the trocar and more than one
        configuration is possible, the one nearest to ``near`` is taken for each pose. The poses must be finite and
        the rotations proper: ``inverse`` and trajectories check that.
        """
        rotations, hinge = self._in_rcm(rotations, positions)
        start = self.home if near is None else as_joints(near)
        joints, clamped = inverse_joints(rotations, hinge, np.tile(start, (len(hinge), 1)), self.instrument)
        joints[:, 3], jumps = steady_roll(joints[:, 3], start[3], np.radians(self.instrument.roll))
        away, angle = pose_errors(links(joints, self.instrument), rotations, hinge)
        jaw, beyond = self._jaw(jaw_deg)
        return PsmPath(joints, jaw, away, angle, np.column_stack([clamped, beyond]), jumps)

    def _in_rcm(self, rotations: Array, positions: Array) -> tuple[Array, Array]:
        turn = self.T_scene_rcm[:3, :3]
        return turn.T @ rotations, (positions - self.rcm) @ turn

    def _in_scene(self, at: Links, jaw_deg: Array) -> tuple[ToolPose, ...]:
        turn = self.T_scene_rcm[:3, :3]
        rows = zip(
            at.hinge @ turn.T + self.rcm, turn @ at.tool_rotation, turn @ at.shaft_rotation, jaw_deg, strict=True
        )
        return tuple(ToolPose(p, r, float(jaw), shaft) for p, r, shaft, jaw in rows)

    def _jaw(self, jaw_deg: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Openings within their range, and which were not."""
        low, high = self.instrument.jaw
        inside = np.minimum(np.maximum(jaw_deg, low), high)
        return inside, np.abs(inside - jaw_deg) > SLACK_DEG

    def tool(self) -> Tool:
        """Contact shapes: two jaws, the wrist and the shaft; they follow the poses that this arm gives."""
        return psm_tool(self.instrument)

    def meshes(self, joints: ArrayLike, jaw_deg: float) -> list[PlacedMesh]:
        """Surfaces for display, vertices (N, 3) in metres of the scene."""
        return psm_meshes(self.instrument, self.forward(joints, jaw_deg), self.rcm)


def _names(hit: tuple[bool, ...]) -> tuple[str, ...]:
    return tuple(name for name, one in zip((*JOINTS, "jaw"), hit, strict=True) if one)


def as_joints(joints: ArrayLike) -> Array:
    """Six finite joint values (6,), rad and m, or InputError."""
    try:
        array = np.asarray(joints, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != (6,) or not np.isfinite(array).all():
        raise InputError(f"joints: expected six finite numbers ({', '.join(JOINTS)}), got {str(joints)[:60]}")
    return array


def steady_roll(roll: Array, start: float, limit: float) -> tuple[Array, NDArray[np.bool_]]:
    """The roll (T,), free up to whole turns, without jumps where its limit lets it, and where it does jump.

    If one shift of the whole unwrapped path keeps inside +-limit (rad), that nearest to ``start`` is taken.
    """
    path = np.unwrap(roll)
    turns = 2 * np.pi * np.arange(-2, 3)
    inside = (path.max() + turns <= limit) & (path.min() + turns >= -limit)
    if inside.any():
        shift = turns[inside][np.abs(path[0] + turns[inside] - start).argmin()]
        return path + shift, np.zeros(len(roll), dtype=bool)
    out, before = np.empty_like(roll), start
    for k, value in enumerate(roll):
        options = value + turns
        options = options[np.abs(options) <= limit]
        out[k] = before = options[np.abs(options - before).argmin()]
    jumps = np.concatenate([[False], np.abs(np.diff(out)) > np.pi])
    return out, jumps
