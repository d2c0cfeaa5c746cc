"""One time step of a scene: state in, state out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..ground.checks import InputError, as_positive
from .advance import BodyReport, Motion, fastest
from .advance_together import advance_all
from .continuous_check import substeps, substeps_at
from .factor import FactorCache
from .near_tools import SPARE, near_samples
from .scene import Scene
from .state import SceneState, ToolPose
from .tool_force import ToolForce
from .tools import between, place


@dataclass(frozen=True)
class StepReport:
    """Reports by body (of the last sub-step), mean force on each tool over the step, and the number of sub-steps."""

    bodies: tuple[BodyReport, ...]
    forces: tuple[ToolForce, ...]
    substeps: int


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
    count = _substeps(scene, state, poses, dt)
    forces = [ToolForce.none() for _ in scene.tools]
    bodies, before, owner = state.bodies, state.tools, scene.part_owner
    reports: tuple[BodyReport, ...] = ()
    for k in range(count):
        after = tuple(between(a, b, (k + 1) / count) for a, b in zip(state.tools, poses, strict=True))
        motion = Motion(scene.tools, before, after, owner)
        results = advance_all(scene.bodies, bodies, motion, scene.options, dt / count, cache, pieces=count)
        bodies, reports, before = tuple(r[0] for r in results), tuple(r[1] for r in results), after
        for report in reports:
            forces = [total.plus(one, 1 / count) for total, one in zip(forces, report.forces, strict=True)]
    return SceneState(bodies, poses, state.time + dt), StepReport(reports, tuple(forces), count)


def _substeps(scene: Scene, state: SceneState, poses: tuple[ToolPose, ...], dt: float) -> int:
    """How often the step is cut; once where no tool comes near any body."""
    count = 1
    for tool, start, end in zip(scene.tools, state.tools, poses, strict=True):
        if substeps(tool, start, end) <= count:
            continue
        parts = (*place(tool, start), *place(tool, end))
        travel = float(np.linalg.norm(end.position - start.position)) / 2
        for body, old in zip(scene.bodies, state.bodies, strict=True):
            within = travel + scene.options.contact_gap + SPARE + fastest(body, old.velocity) * dt
            points = body.sample_positions(old.z, near_samples(body, old.z, parts, within))
            count = max(count, substeps_at(tool, start, end, points))
    return count
