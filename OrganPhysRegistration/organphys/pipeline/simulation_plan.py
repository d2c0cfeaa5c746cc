"""What a simulation of one organ under one instrument starts from: scene, tool poses, and what the user must know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from ..ground.notices import Notice
from ..mechanics.tissue import GENERIC
from ..points.trajectory import Trajectory
from ..simulation.body import Body
from ..simulation.local_detail import LocalDetail
from ..simulation.options import SimulationOptions
from ..simulation.organ_body import metres_per_unit
from ..simulation.psm import Psm
from ..simulation.psm_trajectory import reachable
from ..simulation.scene import Scene
from ..simulation.state import ToolPose
from ..simulation.tools import place

MOST_STEPS = 100_000
TOUCH = 1e-4  # m: a tool this deep in the organ at the start is told


@dataclass(frozen=True)
class SimulationPlan:
    """poses: one of the instrument for the start and for every step of ``dt`` s; detail: local functions, if wanted."""

    organ: RegisteredOrgan
    scene: Scene
    psm: Psm
    poses: tuple[ToolPose, ...]
    dt: float
    notices: tuple[Notice, ...]
    detail: LocalDetail | None = None


def simulation_plan(
    organ: RegisteredOrgan,
    body: Body,
    psm: Psm,
    trajectory: Trajectory,
    *,
    fps: float,
    options: SimulationOptions,
    detail: LocalDetail | None = None,
) -> SimulationPlan:
    """The plan for a trajectory of the tip in any frame; poses beyond the joint limits are clamped and told."""
    steps = step_count(trajectory, fps)
    T_sim_scene = Similarity(metres_per_unit(organ), np.eye(3), np.zeros(3))
    tips = trajectory.in_metres(T_sim_scene, T_sim_scene @ organ.T_scene_ct)
    tips = tips.resampled(tips.times[0] + np.arange(steps + 1) / fps)
    reach = reachable(psm, tips)
    scene = Scene((body,), (psm.tool(),), options)
    notices = (*_tissue(body), *scene.notices(), *_adrift(scene), *reach.notices(), *_inside(scene, reach.poses[0]))
    return SimulationPlan(organ, scene, psm, reach.poses, 1 / fps, notices, detail)


def step_count(trajectory: Trajectory, fps: float) -> int:
    """Steps that a trajectory takes; InputError for a rate or a number of them that cannot be meant."""
    if not 1 <= fps <= 1000:
        raise InputError(f"--fps: expected 1 to 1000 steps per second, got {fps:g}")
    steps = max(1, round(trajectory.duration * fps))
    if steps > MOST_STEPS:
        raise InputError(
            f"trajectory: {trajectory.duration:g} s at {fps:g} steps per second are more than {MOST_STEPS} steps"
        )
    return steps


def _tissue(body: Body) -> tuple[Notice, ...]:
    if body.tissue != GENERIC:
        return ()
    text = f"{body.name} is simulated as generic soft tissue ({GENERIC.youngs_pa:g} Pa); --tissue names an organ's own"
    return (Notice("generic_tissue", text),)


def _adrift(scene: Scene) -> tuple[Notice, ...]:
    body = scene.bodies[0]
    if body.held.any() or scene.options.felt_gravity.any():  # with gravity the scene says it
        return ()
    text = f"{body.name} has no pins: nothing holds it, the instrument pushes all of it away; --pins holds it"
    return (Notice("unpinned", text),)


def _inside(scene: Scene, pose: ToolPose) -> tuple[Notice, ...]:
    points = scene.bodies[0].samples.points
    gaps: list[Array] = [part.gap_and_normal(points)[0] for part in place(scene.tools[0], pose)]
    depth = -float(np.min(gaps))
    if depth < TOUCH:
        return ()
    text = f"the tool starts {1000 * depth:.1f} mm inside the surface of the organ: it is pushed out gently"
    return (Notice("tool_inside", text),)
