"""One time step of a scene: state in, state out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import InputError, as_positive
from .advance import LEAST_EFFORT, OVERHEAD, BodyReport, Motion
from .advance_together import advance_all
from .continuous_check import farthest_way, substeps, substeps_at
from .factor import FactorCache
from .near_tools import near_samples
from .scene import Scene
from .state import SceneState, ToolPose
from .tool_force import ToolForce
from .tool_reach import ToolReach, expected_way, tool_reach
from .tools import between, place, placed

FOLLOWING = 70  # Hessian products take as long, those after a change with the new stiffness


@dataclass(frozen=True)
class StepReport:
    """Reports by body (of the last sub-step), mean force on each tool over the step, the number of sub-steps, and what
    all of them cost for the body that cost most, see ``SimulationOptions``."""

    bodies: tuple[BodyReport, ...]
    forces: tuple[ToolForce, ...]
    substeps: int
    effort: int


def step(
    scene: Scene, state: SceneState, poses: tuple[ToolPose, ...], dt: float, *, cache: FactorCache | None = None
) -> tuple[SceneState, StepReport]:
    """The scene ``dt`` s later, with the tools moved to ``poses``; InputError for poses or dt that are not finite.

    Same arguments, same result; ``cache`` only saves time when it is handed in again with the next step.
    """
    poses, dt = scene.checked_poses(tuple(poses)), as_positive(dt, "dt")
    cache = FactorCache() if cache is None else cache
    if len(state.bodies) != len(scene.bodies):
        raise InputError(f"state: expected {len(scene.bodies)} bodies, got {len(state.bodies)}")
    count, reaches = _plan(scene, state, poses, dt)
    forces, left = [ToolForce.none() for _ in scene.tools], scene.options.effort - _following(scene)
    bodies, before, owner = state.bodies, state.tools, scene.part_owner
    reports: tuple[BodyReport, ...] = ()
    for k in range(count):
        after = tuple(between(a, b, (k + 1) / count) for a, b in zip(state.tools, poses, strict=True))
        motion = Motion(scene.tools, before, after, owner)
        effort = max(left // (count - k) - OVERHEAD, LEAST_EFFORT)
        results = advance_all(scene.bodies, bodies, motion, scene.options, dt / count, cache, reaches, effort=effort)
        bodies, reports, before = tuple(r[0] for r in results), tuple(r[1] for r in results), after
        left -= OVERHEAD + max(report.effort for report in reports)
        for report in reports:
            forces = [total.plus(one, 1 / count) for total, one in zip(forces, report.forces, strict=True)]
    return SceneState(bodies, poses, state.time + dt), StepReport(
        reports, tuple(forces), count, scene.options.effort - left
    )


def _following(scene: Scene) -> int:
    """What is set aside for local functions that follow the contact: they are made, and their stiffness is."""
    return FOLLOWING if any(body.plain is not None for body in scene.bodies) else 0


def _plan(scene: Scene, state: SceneState, poses: tuple[ToolPose, ...], dt: float) -> tuple[int, tuple[ToolReach, ...]]:
    """How often the step is cut, once where no tool comes near any body, and what tools may touch of each body."""
    moves = tuple(zip(scene.tools, state.tools, poses, strict=True))
    parts = (*placed(scene.tools, state.tools), *placed(scene.tools, poses))
    fast = [move for move in moves if substeps(*move) > 1]
    travel = max((farthest_way(*move) / 2 for move in fast), default=0.0)
    reaches = tuple(
        tool_reach(body, old, parts, travel, scene.options, dt)
        for body, old in zip(scene.bodies, state.bodies, strict=True)
    )
    count = 1
    for body, old, reach in zip(scene.bodies, state.bodies, reaches, strict=True):
        for tool, start, end in fast:
            ends = (*place(tool, start), *place(tool, end))
            shift = float(np.linalg.norm(end.position - start.position)) / 2
            within = scene.options.contact_gap + expected_way(body, old, dt) + shift
            near = near_samples(body, old.z, ends, within, reach.patches)
            count = max(count, substeps_at(tool, start, end, body.sample_positions(old.z, near)))
    return count, reaches
