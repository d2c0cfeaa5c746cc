"""Nothing jumps through: how finely a tool's motion is cut, and whether tissue has crossed to a tool's far side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..ground.checks import Array
from ..ground.frames import rotation_angle
from .state import ToolPose
from .tools import PlacedPart, Tool, place

PART_OF_RADIUS = 0.8  # a tool moves at most so many of its radii within one sub-step
MOST_SUBSTEPS = 64
SHORT = 0.7  # radii: it is farther to the middle of a part from all points less than 0.3 radii deep


def substeps(tool: Tool, start: ToolPose, end: ToolPose) -> int:
    """Number of sub-steps so that no point of the whole tool moves too far in one."""
    return _pieces(farthest_way(tool, start, end), tool)


def farthest_way(tool: Tool, start: ToolPose, end: ToolPose) -> float:
    """A way, m, that no point of the tool exceeds in going from ``start`` to ``end``."""
    shift = float(np.linalg.norm(end.position - start.position))
    turn = float(rotation_angle(start.rotation, end.rotation))
    if start.shaft_rotation is not None and end.shaft_rotation is not None:
        turn = max(turn, float(rotation_angle(start.shaft_rotation, end.shaft_rotation)))
    opening = float(np.radians(abs(end.jaw_deg - start.jaw_deg))) / 2
    return shift + turn * tool.extent + opening * tool.jaw_extent


def substeps_at(tool: Tool, start: ToolPose, end: ToolPose, points: Array) -> int:
    """The same for tissue at points (N, 3) alone: by how far the tool would carry them if they stuck to it."""
    travel = 0.0
    for old, new in zip(place(tool, start), place(tool, end), strict=True):
        moved = new.to_scene(old.to_local(points)) - points
        travel = max(travel, float(np.sqrt((moved**2).sum(1).max(initial=0.0))))
    return _pieces(travel, tool)


def _pieces(travel: float, tool: Tool) -> int:
    return int(np.clip(np.ceil(travel / (PART_OF_RADIUS * tool.radius)), 1, MOST_SUBSTEPS))


class PathStart(NamedTuple):
    """Where paths begin, in the frame of a part at the start of a step: local (N, 3) m, normal (N, 3) of the part."""

    local: Array
    normal: Array

    @classmethod
    def of(cls, part: PlacedPart, start: Array) -> PathStart:
        local = part.to_local(start)
        return cls(local, part.shape.gap_and_normal(local)[1])


def crossed(old: PlacedPart, new: PlacedPart, start: Array, end: Array) -> bool:
    """Whether any point goes through a part: paths from ``start`` to ``end`` (N, 3) while the part goes old -> new."""
    return path_crosses(PathStart.of(old, start), new, end)


def path_crosses(start: PathStart, new: PlacedPart, end: Array) -> bool:
    """The same for paths whose beginnings are known already.

    In the part's own frame a path that has been inside it and ends on the other side has crossed it. Paths too short
    for that are not looked at, so tissue deep inside a part leaves it on the nearest side.
    """
    shape, b = new.shape, new.to_local(end)
    squared = ((b - start.local) ** 2).sum(1)
    long = np.flatnonzero(squared > (SHORT * shape.radius) ** 2)
    if not len(long):
        return False
    a, b = start.local[long], b[long]
    turned = np.flatnonzero((start.normal[long] * shape.gap_and_normal(b)[1]).sum(1) < 0)
    if not len(turned):
        return False
    a, b = a[turned], b[turned]
    pieces = int(np.clip(np.ceil(4 * np.sqrt(squared.max()) / shape.radius), 4, 100))
    along = np.linspace(0, 1, pieces + 1)[:, None, None]
    return bool((shape.gap_and_normal((a + along * (b - a)).reshape(-1, 3))[0] < 0).any())
