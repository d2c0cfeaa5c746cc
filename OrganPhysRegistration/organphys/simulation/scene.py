"""What is simulated: bodies side by side, tools and options. It never changes; edits give a new scene."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.notices import Notice, plain_number
from .body import Body
from .options import SimulationOptions
from .state import BodyState, SceneState, ToolPose
from .tools import Tool, checked_pose


@dataclass(frozen=True)
class Scene:
    """Bodies feel each other, the tools, gravity and their own pins."""

    bodies: tuple[Body, ...]
    tools: tuple[Tool, ...] = ()
    options: SimulationOptions = field(default_factory=SimulationOptions)

    def __post_init__(self) -> None:
        if not self.bodies:
            raise InputError("scene: expected at least one body")

    @property
    def part_owner(self) -> NDArray[np.int64]:
        """The tool (P,) of every part, the parts of all tools in a row."""
        return np.repeat(np.arange(len(self.tools)), [len(tool.parts) for tool in self.tools])

    def initial_state(self, *poses: ToolPose) -> SceneState:
        """All bodies at rest in the registered geometry, the tools at ``poses``."""
        bodies = tuple(BodyState.at_rest(body.basis.size, len(self.tools)) for body in self.bodies)
        return SceneState(bodies, self.checked_poses(poses))

    def checked_poses(self, poses: tuple[ToolPose, ...]) -> tuple[ToolPose, ...]:
        """One sound pose per tool, or InputError."""
        if len(poses) != len(self.tools):
            raise InputError(f"tool poses: expected {len(self.tools)}, one per tool, got {len(poses)}")
        return tuple(checked_pose(p, f"pose of {tool.name}") for p, tool in zip(poses, self.tools, strict=True))

    def with_body(self, index: int, body: Body) -> Scene:
        """This scene with one body exchanged; on another basis its state must be ``transferred``."""
        return replace(self, bodies=(*self.bodies[:index], body, *self.bodies[index + 1 :]))

    def notices(self) -> tuple[Notice, ...]:
        """What the user should know before the run."""
        out = []
        for body in self.bodies:
            if self.options.felt_gravity.any() and not body.held.any():
                out.append(Notice("unpinned", f"{body.name} has no pins: it will fall with gravity"))
            for tool in self.tools:
                if body.samples.spacing > 0.5 * tool.radius * (1 + 1e-9):
                    spacing, radius = (plain_number(1000 * x) for x in (body.samples.spacing, tool.radius))
                    text = f"{tool.name} of radius {radius} mm may sink in between contact samples {spacing} mm apart"
                    out.append(Notice("coarse_samples", f"{text}: take a sample spacing of half the radius"))
        return tuple(out)
