"""A simulation of one organ and one instrument that runs on and on: what the module steps, shows and records."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from organphys.ground.checks import Array
from organphys.mechanics.tissue import Tissue
from organphys.simulation.body import Body
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.options import SimulationOptions
from organphys.simulation.pins import AnyPin
from organphys.simulation.psm import Psm
from organphys.simulation.scene import Scene
from organphys.simulation.session import Recording, Simulation
from organphys.simulation.state import SceneState, ToolPose

from .arm import ArmState, moved, wanted_by_pose
from .preparation import Followers, Preparation, repinned_followers
from .readings import Reading, Readings

DT = 1 / 60  # s
OPEN_DEG = 40.0  # of the jaws at the start
CLEAR = 0.015  # m between jaws and organ at the start


class LiveSimulation:
    """``wanted``: where the arm shall go; each ``step`` brings it nearer. Undo goes back to the last ``mark``."""

    def __init__(self, prepared: Preparation, psm: Psm, *, options: SimulationOptions, detail: bool = False) -> None:
        self.prepared, self.psm = prepared, psm
        self.arm = self.wanted = self._first_arm = ArmState(withdrawn(psm, prepared), OPEN_DEG)
        self.readings = Readings()
        self.limits: tuple[str, ...] = ()
        self._followers: list[tuple[Body, Followers]] = [(prepared.body, prepared.followers)]
        scene = Scene((prepared.body,), (psm.tool(),), options)
        self._detail = LocalDetail() if detail else None
        self._start(scene, scene.initial_state(self.pose))

    # what is shown

    @property
    def pose(self) -> ToolPose:
        """The tool now."""
        return self.psm.forward(self.arm.joints, self.arm.jaw_deg)

    @property
    def body(self) -> Body:
        return self.simulation.scene.bodies[0]

    @property
    def z(self) -> Array:
        """Coordinates of the organ's shape (n, 3), m."""
        return self.simulation.state.bodies[0].z

    @property
    def time_s(self) -> float:
        return self.simulation.state.time

    @property
    def followers(self) -> Followers:
        """Surface and splat on the body's present basis; they are computed where undo led to former pins."""
        plain = self.body.plain or self.body
        for body, followers in self._followers:
            if body.basis is plain.basis:
                return followers
        self._followers.append((plain, repinned_followers(self.prepared, plain)))
        del self._followers[:-3]
        return self._followers[-1][1]

    def displacement(self) -> Array:
        """Displacement (N, 3) m of the surface's vertices."""
        return self.followers.surface.displacement(self.body, self.z)

    def warnings(self) -> list[str]:
        """What the user should know, in plain words."""
        return [notice.message for notice in self.simulation.scene.notices()]

    # moving

    def aim(self, pose: ToolPose) -> None:
        """The tool shall go to ``pose``; ``limits`` names the joints that keep it from there. InputError for NaN."""
        self.wanted, solution = wanted_by_pose(self.psm, pose, self.wanted)
        self.limits = solution.limits

    def aim_joints(self, joints: Array, jaw_deg: float) -> None:
        """The arm shall go to joints (6,), rad and m, within the instrument's ranges."""
        self.psm.forward(joints, jaw_deg)  # refuses what is not finite
        self.wanted, self.limits = ArmState(np.array(joints, dtype=float), float(jaw_deg)), ()

    def step(self, dt: float = DT) -> Reading:
        """One step of ``dt`` s; nothing changes if it is refused."""
        began = time.perf_counter()
        arm = moved(self.psm, self.arm, self.wanted, dt)
        report = self.simulation.step((self.psm.forward(arm.joints, arm.jaw_deg),), dt=dt)
        self.arm = arm
        held = sum(len(grip.sample) for grip in self.simulation.state.bodies[0].grips)
        spent = 1e3 * (time.perf_counter() - began)
        return self.readings.add(report, time_s=self.time_s, dt=dt, step_ms=spent, held=held)

    def mark(self) -> None:
        """Remember this moment for ``undo``."""
        self.simulation.mark()
        self._marks.append(self.arm)

    @property
    def can_undo(self) -> bool:
        return bool(self._marks)

    def undo(self) -> None:
        """Back to the last mark; InputError if there is none."""
        self.simulation.undo()
        self.arm = self.wanted = self._marks.pop()
        self.readings.clear()

    def reset(self) -> None:
        """Back to the beginning, with the tissue, pins and options of now."""
        scene = self.simulation.scene.with_body(0, self.body.plain or self.body)
        self.arm = self.wanted = self._first_arm
        self._start(scene, scene.initial_state(self.pose))
        self.readings.clear()

    def joints_at_contact(self, *, depth: float = 0.006) -> Array:
        """Joints (6,) with the straight instrument inserted until its tip is ``depth`` m inside the organ at rest."""
        joints, surface = self._first_arm.joints.copy(), self.prepared.body.shape.surface
        tip = np.array([0.0, 0.0, self.psm.instrument.jaw_length])
        for depth_in in np.arange(joints[2], self.psm.instrument.insertion, 0.001):
            joints[2] = depth_in
            pose = self.psm.forward(joints, 0.0)
            if surface.signed_with_foot((pose.position + pose.rotation @ tip)[None])[0][0] < -depth:
                break
        return joints

    # edits

    def set_pins(self, pins: tuple[AnyPin, ...]) -> None:
        """Other pins from now on; takes seconds. InputError: one holds nothing, and the old ones stay."""
        self.simulation.set_pins(0, *pins)
        _ = self.followers

    def set_options(self, options: SimulationOptions) -> None:
        """Gravity, damping, friction, ... from now on."""
        self.simulation.set_options(options)

    @property
    def options(self) -> SimulationOptions:
        return self.simulation.scene.options

    def set_tissue(self, tissue: Tissue) -> None:
        """Another tissue from now on; recording and undo begin anew."""
        self._exchange(lambda scene: scene.with_body(0, scene.bodies[0].with_tissue(tissue)))

    def set_detail(self, on: bool) -> None:
        """Local functions where the tool touches, or none; recording and undo begin anew."""
        if on != (self._detail is not None):
            self._detail = LocalDetail() if on else None
            self._exchange(lambda scene: scene)

    def recording(self) -> Recording:
        """What was done since the beginning, the last reset or the last change of tissue or detail."""
        return self.simulation.recording()

    def _exchange(self, change: Callable[[Scene], Scene]) -> None:
        self._start(change(self.simulation.scene), self.simulation.state)

    def _start(self, scene: Scene, state: SceneState) -> None:
        self.simulation = Simulation(scene, state, detail=self._detail)
        self._marks = []


def withdrawn(psm: Psm, prepared: Preparation) -> Array:
    """Joints (6,) of the straight instrument, inserted until its jaws are ``CLEAR`` m before the organ."""
    joints, surface = psm.home.copy(), prepared.body.shape.surface
    along = np.linspace(0, psm.instrument.jaw_length, 5)[:, None]
    joints[2] = 0.0
    for depth in np.arange(0.0, psm.instrument.insertion, 0.005):
        pose = psm.forward(np.concatenate([joints[:2], [depth], joints[3:]]), 0.0)
        if surface.signed_with_foot(pose.position + along * pose.rotation[:, 2])[0].min() < CLEAR:
            break
        joints[2] = depth
    return joints
