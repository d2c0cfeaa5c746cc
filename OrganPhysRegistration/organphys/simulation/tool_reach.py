"""The patches of contact samples that tools may touch in a whole step, found once for all its sub-steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..ground.checks import Array
from .body import Body
from .near_tools import SPARE, Patches, near_patches
from .options import SimulationOptions
from .state import BodyState
from .tools import PlacedPart

SURE = 1.3  # samples between the middles of patches may move farther than these


class ToolReach(NamedTuple):
    """Patches with the samples within ``width`` m of where tools pass while the body is at Z (n, 3)."""

    patches: Patches
    z: Array
    width: float

    def covers(self, body: Body, z: Array, within: float) -> bool:
        """Whether all samples within ``within`` m of the tools at Z (n, 3) are in these patches."""
        return within + SURE * farthest(body, z - self.z) <= self.width


def tool_reach(
    body: Body, state: BodyState, parts: tuple[PlacedPart, ...], travel: float, options: SimulationOptions, dt: float
) -> ToolReach:
    """Reach of tools with ``parts`` at the start and the end of a step of ``dt`` s; no point of theirs is ever farther
    than ``travel`` m from where it is at one of these ends."""
    width = options.contact_gap + 2 * expected_way(body, state, dt)
    return ToolReach(near_patches(body, state.z, parts, width + travel), state.z, width)


def expected_way(body: Body, state: BodyState, dt: float) -> float:
    """How far tissue is expected to move at most within ``dt`` s, m."""
    return SPARE + 1.5 * dt * farthest(body, state.velocity)


def farthest(body: Body, change: Array) -> float:
    """Largest way of the middles of all patches, m, at a change of the coordinates (n, 3); or speed, at a velocity."""
    way = body.middle_phi @ change
    return float(np.sqrt(np.einsum("ka,ka->k", way, way).max()))
