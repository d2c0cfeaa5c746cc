"""Runs a plan step by step and keeps what the files of a simulation hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..ground.checks import Array
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..simulation.body import Body
from ..simulation.session import Recording, Simulation, Snapshot
from ..simulation.state import ToolPose
from ..simulation.step import StepReport
from .simulation_plan import SimulationPlan

GRIP_LOST = 0.5  # of the caught samples


class Step(NamedTuple):
    """One moment: its number (0: the start), the snapshot, and the step's report (none at the start)."""

    number: int
    moment: Snapshot
    report: StepReport | None


@dataclass
class SimulationLog:
    """Rows per moment, the start first: time s, force (3,) N on the tool, torque (3,) N m about the jaws' hinge,
    volume ml, smallest det F, deepest penetration mm, contacts, samples held, coordinates z (n, 3) m of
    the handles, tool pose."""

    time_s: list[float] = field(default_factory=list)
    force_n: list[Array] = field(default_factory=list)
    torque_nm: list[Array] = field(default_factory=list)
    volume_ml: list[float] = field(default_factory=list)
    min_det_f: list[float] = field(default_factory=list)
    deepest_mm: list[float] = field(default_factory=list)
    contacts: list[int] = field(default_factory=list)
    held: list[int] = field(default_factory=list)
    z: list[Array] = field(default_factory=list)
    poses: list[ToolPose] = field(default_factory=list)
    notices: list[Notice] = field(default_factory=list)

    def add(self, step: Step) -> None:
        """The row of one moment."""
        body, state = step.moment.scene.bodies[0], step.moment.state
        now, report = state.bodies[0], step.report
        rest = 1e6 * float(body.strain.weights.sum())
        none = np.zeros(3)
        self.time_s.append(state.time)
        self.force_n.append(none if report is None else report.forces[0].force)
        self.torque_nm.append(none if report is None else report.forces[0].torque)
        self.volume_ml.append(rest * (1 + (0.0 if report is None else report.bodies[0].volume_change)))
        self.min_det_f.append(1.0 if report is None else report.bodies[0].min_det)
        self.deepest_mm.append(0.0 if report is None else 1000 * report.bodies[0].deepest_m)
        self.contacts.append(0 if report is None else report.bodies[0].contacts)
        self.held.append(len(now.grips[0].sample))
        self.z.append(handle_coordinates(body, now.z))
        self.poses.append(state.tools[0])


def handle_coordinates(body: Body, z: Array) -> Array:
    """Coordinates (n, 3) of the columns without the local functions; what these add is left out."""
    local = body.basis.local
    if local is None:
        return z
    count = body.basis.mixing.shape[1]
    base: Array = z[:count] - local.overlap @ z[count:]
    return base


def run_plan(
    plan: SimulationPlan, watch: Callable[[Step], None], *, progress: Progress = no_progress
) -> tuple[SimulationLog, Recording]:
    """Run it; ``watch`` sees every moment as it comes. What happened on the way is among the log's notices."""
    log, simulation = (
        SimulationLog(),
        Simulation(plan.scene, plan.scene.initial_state(plan.poses[0]), detail=plan.detail),
    )
    for step in _steps(plan, simulation):
        log.add(step)
        watch(step)
        progress("simulate", step.number / (len(plan.poses) - 1))
    caught = max(log.held)
    if caught and log.held[-1] < GRIP_LOST * caught and plan.poses[-1].jaw_deg <= plan.poses[0].jaw_deg / 2:
        text = f"the tissue slipped: {log.held[-1]} of {caught} caught samples are still between the jaws at the end"
        log.notices.append(Notice("slipped", text))
    return log, simulation.recording()


def _steps(plan: SimulationPlan, simulation: Simulation) -> Iterator[Step]:
    yield Step(0, simulation.snapshot, None)
    for number, pose in enumerate(plan.poses[1:], start=1):
        report = simulation.step((pose,), dt=plan.dt)
        yield Step(number, simulation.snapshot, report)
