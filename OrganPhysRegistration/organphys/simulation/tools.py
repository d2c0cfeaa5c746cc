"""Tools: rigid parts, two of which may be jaws, and where they are.

Tool frame: origin at the hinge of the jaws, z forward to the tip, x along the hinge. The jaws lie along +z when
closed and open by half the jaw angle each, about x.

A tool may have a wrist: a link from a pitch axis to the hinge, and a shaft behind that axis. Both frames have their
origin on the pitch axis, which is their y, and z forward; that of the wrist has x along the hinge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ..ground.checks import Array, InputError, as_positive, as_vector, one_of
from ..ground.frames import cross_matrix, rotation_about
from .state import ToolPose
from .tool_shapes import Capsule, Shape


@dataclass(frozen=True)
class Part:
    """A shape in the frame of its link; ``jaw`` -1 or +1: turns about x by jaw * opening / 2, 0: does not.

    ``link``: "tool", or of a tool with a wrist "wrist" or "shaft".
    """

    shape: Shape
    jaw: int = 0
    link: str = "tool"


@dataclass(frozen=True)
class Jaws:
    """What the jaws hold and how firmly: lengths in m, angles in degrees, stiffness in N/m, force in N.

    They close on the tissue between them below ``close_deg`` and let go above ``open_deg``; ``reach``: tissue so far
    beside and before the closed jaws is caught as well, since a reduced body does not fold in between; ``stiffness``
    of all springs together; the tissue slips where more than ``force_limit`` would be needed in all.
    """

    length: float = 0.0095
    half_width: float = 0.0025
    reach: float = 0.003
    close_deg: float = 12.0
    open_deg: float = 20.0
    stiffness: float = 3000.0
    force_limit: float = 5.0

    def __post_init__(self) -> None:
        for name in ("length", "half_width", "reach", "close_deg", "stiffness", "force_limit"):
            as_positive(getattr(self, name), name)
        if self.open_deg <= self.close_deg:
            raise InputError(f"open_deg: expected more than close_deg {self.close_deg}, got {self.open_deg}")


@dataclass(frozen=True)
class Tool:
    """Parts; ``jaws`` None: the tool only pushes; ``wrist_length`` m: from the pitch axis to the hinge."""

    parts: tuple[Part, ...]
    jaws: Jaws | None = None
    name: str = "tool"
    wrist_length: float = 0.0

    def __post_init__(self) -> None:
        links = ("tool", "wrist", "shaft") if self.wrist_length > 0 else ("tool",)
        for part in self.parts:
            one_of(part.link, f"link of a part of {self.name}", links)
            if part.jaw not in (-1, 0, 1) or (part.jaw and part.link != "tool"):
                raise InputError(f"{self.name}: expected jaw -1 or 1 on parts of the link 'tool' only, got {part.jaw}")

    @property
    def radius(self) -> float:
        """Thinnest part, m."""
        return min(part.shape.radius for part in self.parts)

    @property
    def extent(self) -> float:
        """Distance of the farthest point from the origin of its frame, m."""
        return max(part.shape.extent + (0.0 if part.link == "tool" else self.wrist_length) for part in self.parts)

    @property
    def jaw_extent(self) -> float:
        """The same of the jaws alone, m; 0 without jaws."""
        return max((part.shape.extent for part in self.parts if part.jaw), default=0.0)


class PlacedPart(NamedTuple):
    """A part in the scene: x_scene = rotation @ x_part + position (m)."""

    shape: Shape
    rotation: Array
    position: Array

    def to_local(self, points: Array) -> Array:
        return (points - self.position) @ self.rotation

    def to_scene(self, points: Array) -> Array:
        return points @ self.rotation.T + self.position

    def gap_and_normal(self, points: Array) -> tuple[Array, Array]:
        """Gap (N,) m and normal (N, 3), away from the part, at points (N, 3) of the scene."""
        gap, normal = self.shape.gap_and_normal(self.to_local(points))
        return gap, normal @ self.rotation.T

    def bend(self, points: Array) -> Array:
        """Second derivative (N, 3, 3) of the gap at points (N, 3) of the scene, 1/m."""
        return self.rotation @ self.shape.bend(self.to_local(points)) @ self.rotation.T


def place(tool: Tool, pose: ToolPose) -> tuple[PlacedPart, ...]:
    """The tool's parts in the scene. Without a ``shaft_rotation`` a wrist is straight; below 0 deg jaws stay closed."""
    half, x = np.radians(max(pose.jaw_deg, 0.0)) / 2, np.array([1.0, 0.0, 0.0])
    turns = {jaw: pose.rotation @ rotation_about(x, jaw * half) for jaw in (-1, 0, 1)}
    frames = {("tool", jaw): (turn, pose.position) for jaw, turn in turns.items()}
    if tool.wrist_length:
        wrist, at, shaft = wrist_frames(pose, tool.wrist_length)
        frames |= {("wrist", 0): (wrist, at), ("shaft", 0): (shaft, at)}
    return tuple(PlacedPart(part.shape, *frames[part.link, part.jaw]) for part in tool.parts)


def placed(tools: tuple[Tool, ...], poses: tuple[ToolPose, ...]) -> tuple[PlacedPart, ...]:
    """The parts of all tools, in a row, at their poses."""
    return tuple(part for tool, pose in zip(tools, poses, strict=True) for part in place(tool, pose))


def wrist_frames(pose: ToolPose, wrist_length: float) -> tuple[Array, Array, Array]:
    """Rotation (3, 3) of the wrist, origin (3,) m of wrist and shaft, rotation (3, 3) of the shaft.

    The link stands on hinge and pitch axis; where these are not quite at right angles (between two poses), on the
    hinge and as nearly as it can on the pitch axis.
    """
    shaft = pose.rotation if pose.shaft_rotation is None else pose.shaft_rotation
    hinge, pitch = pose.rotation[:, 0], shaft[:, 1]
    along = cross_matrix(hinge) @ pitch
    along = along / np.linalg.norm(along)
    wrist = np.stack([hinge, cross_matrix(along) @ hinge, along], axis=1)
    return wrist, pose.position - wrist_length * along, shaft


def checked_pose(pose: ToolPose, name: str) -> ToolPose:
    """The pose with plain arrays; InputError for numbers that are not finite or no rotation."""
    rotation = _checked_rotation(pose.rotation, f"{name}: its rotation")
    shaft = pose.shaft_rotation
    if shaft is not None:
        shaft = _checked_rotation(shaft, f"{name}: its shaft_rotation")
        if abs(rotation[:, 0] @ shaft[:, 1]) > 1e-3:
            raise InputError(
                f"{name}: the pitch axis of its shaft_rotation (y) must be at right angles to the hinge (x)"
            )
    if not np.isfinite(pose.jaw_deg):
        raise InputError(f"{name}: jaw opening must be finite, got {pose.jaw_deg}")
    return ToolPose(as_vector(pose.position, f"{name} position"), rotation, float(pose.jaw_deg), shaft)


def _checked_rotation(matrix: Array, name: str) -> Array:
    rotation = np.array(matrix, dtype=np.float64, order="C")  # the layout changes the rounding of products
    proper = rotation.shape == (3, 3) and np.isfinite(rotation).all()
    if not proper or np.abs(rotation @ rotation.T - np.eye(3)).max() > 2e-6 or np.linalg.det(rotation) < 0:
        raise InputError(f"{name} must be a finite proper rotation of shape (3, 3)")
    return rotation


def between(start: ToolPose, end: ToolPose, fraction: float) -> ToolPose:
    """Pose on the way from ``start`` (fraction 0) to ``end`` (1): straight, turning evenly."""
    if fraction >= 1:
        return end
    shafts = [pose.rotation if pose.shaft_rotation is None else pose.shaft_rotation for pose in (start, end)]
    bent = start.shaft_rotation is not None or end.shaft_rotation is not None
    return ToolPose(
        start.position + fraction * (end.position - start.position),
        _turned(start.rotation, end.rotation, fraction),
        start.jaw_deg + fraction * (end.jaw_deg - start.jaw_deg),
        _turned(shafts[0], shafts[1], fraction) if bent else None,
    )


def _turned(start: Array, end: Array, fraction: float) -> Array:
    turn: Array = Slerp([0.0, 1.0], Rotation.from_matrix(np.stack([start, end])))(fraction).as_matrix()
    return turn


def probe(radius: float = 0.0025, length: float = 0.1) -> Tool:
    """A straight rod with a round tip at the origin of its frame, its shaft along -z; metres."""
    return Tool((Part(Capsule(np.zeros(3), np.array([0, 0, -length]), radius)),), name="probe")


def gripper(
    jaws: Jaws | None = None, *, jaw_radius: float = 0.002, shaft_radius: float = 0.0025, shaft_length: float = 0.1
) -> Tool:
    """Two capsule jaws and a shaft along -z; metres. The closed jaws touch each other along the z axis."""
    jaws = jaws or Jaws()
    parts = []
    for side in (-1, 1):  # a positive turn about x moves +z towards -y
        offset = np.array([0.0, -side * jaw_radius, 0.0])
        parts.append(Part(Capsule(offset, offset + np.array([0, 0, jaws.length]), jaw_radius), side))
    shaft = Capsule(np.array([0, 0, -shaft_radius]), np.array([0, 0, -shaft_length]), shaft_radius)
    return Tool((*parts, Part(shaft)), jaws, "gripper")
