"""A simulation in the scene: the running organ, its nodes, its drawing in the views; made whole, removed whole."""

from __future__ import annotations

from typing import Any

import numpy as np

from organphys.ground.checks import Array
from organphys.simulation.blas_threads import one_blas_thread
from organphys.simulation.pins import AnyPin

from .choices import Colouring
from .engine.live_simulation import DT, LiveSimulation
from .engine.readings import Reading
from .engine.tool_path import ToolPath
from .outputs.frame_node import T_world_sim, write_frame
from .outputs.pin_balls import write_pin_balls
from .outputs.recorder import Recorder
from .outputs.surface_node import SurfaceNode, state_of
from .outputs.tool_nodes import ToolNodes
from .roles import remove_all
from .views.hidden_results import HiddenResults
from .views.splat_view import SplatView


class SimulationSession:
    """``live``: the simulation; ``splat``: its node or None; ``case``: that of the registration or None."""

    @one_blas_thread
    def __init__(self, live: LiveSimulation, splat: Any, case: Any = None) -> None:
        self.live, self.splat = live, splat
        self.path: ToolPath | None = None
        self.recorder: Recorder | None = None
        self.frame = write_frame(splat, live.prepared.unit)
        self.surface = SurfaceNode(self.frame, live.followers.surface)
        self.tool = ToolNodes(self.frame, live.psm)
        self.splat_view = None if splat is None else SplatView(splat)
        self._results = HiddenResults(case)
        self.publish()
        self.show_pins(True)

    # moving

    def step(self, dt: float = DT) -> Reading:
        """One step; the tool goes on towards the handle, the sliders or the trajectory. Nothing is drawn."""
        self._aim()
        reading = self.live.step(dt)
        if self.path is not None and self.path.over(self.live.time_s):
            self.path = None
        return reading

    @one_blas_thread
    def publish(self) -> None:
        """Show the present state: surface, instrument, splat; and record it if a recording runs."""
        live = self.live
        self.surface.write(live.followers.surface, live.displacement(), live.z)
        self.tool.write(live.arm)
        if self.path is not None:
            self.tool.write_handle(live.pose)
        if self.splat_view is not None:
            self.splat_view.follow(live.followers.binding, live.body, live.z)
        if self.recorder is not None:
            self.recorder.add(live.time_s)

    def aim_joints(self, joints: Array, jaw_deg: float) -> None:
        """The arm shall go there; the handle jumps along."""
        self.path = None
        self.live.aim_joints(joints, jaw_deg)
        self.place_handle()

    def place_handle(self) -> None:
        """Put the handle where the tool is wanted."""
        live = self.live
        self.tool.write_handle(live.psm.forward(live.wanted.joints, live.wanted.jaw_deg))

    def undo(self) -> None:
        """Back to the last mark; InputError if there is none."""
        self.live.undo()
        self._jumped()

    def reset(self) -> None:
        """Back to the beginning."""
        self.live.reset()
        self._jumped()

    def start_recording(self) -> None:
        """Record every shown frame from now on."""
        nodes = {"surface": self.surface.node, "instrument": self.tool.model, "tool": self.tool.handle}
        self.recorder = Recorder(self.live.prepared.organ.name, nodes)
        self.publish()

    # what is shown

    def colour_by(self, colouring: Colouring) -> None:
        """What the surface's colours say."""
        self.surface.colour_by(colouring)
        self.publish()

    def show_surface(self, shown: bool) -> None:
        self.surface.node.GetDisplayNode().SetVisibility(shown)

    def show_splat(self, shown: bool) -> None:
        if self.splat_view is not None:
            live = self.live
            self.splat_view.follow(live.followers.binding, live.body, live.z)
            self.splat_view.show(shown)

    def show_pins(self, shown: bool) -> None:
        write_pin_balls(self.frame, self.pins, shown=shown)

    def show_recorded(self) -> None:
        """Let the splat follow the surface node, which shows a recorded frame."""
        z, live = state_of(self.surface.node), self.live
        if self.splat_view is not None and z is not None and z.shape == live.z.shape:
            self.splat_view.follow(live.followers.binding, live.body, z)

    @property
    def pins(self) -> tuple[AnyPin, ...]:
        return self.live.body.pins

    @property
    def T_world_sim(self) -> Array:
        """(4, 4) from simulation mm to world mm."""
        return T_world_sim(self.frame)

    def gravity_direction(self) -> Array | None:
        """Direction (3,) of gravity in the scene, None: there is none."""
        gravity = np.asarray(self.live.options.gravity)
        return gravity / np.linalg.norm(gravity) if gravity.any() else None

    def close(self) -> None:
        """Remove everything the session put into scene and views; recordings stay."""
        if self.recorder is not None:
            self.recorder.finish()
            self.recorder = None
        if self.splat_view is not None:
            self.splat_view.remove()
            self.splat_view = None
        self._results.restore()
        remove_all()

    def _aim(self) -> None:
        live = self.live
        if self.path is not None:
            live.aim(self.path.at(live.time_s, live.psm))
            return
        pose = self.tool.dragged(live.wanted.jaw_deg)
        if pose is not None:
            live.aim(pose)

    def _jumped(self) -> None:
        self.path = None
        self.place_handle()
        self.publish()
