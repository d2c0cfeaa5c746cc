"""What can be changed about a simulation that goes on: tool, tissue, gravity, pins. Part of the module's logic."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from organphys.readers.trajectory_file import read_trajectory
from organphys.simulation.psm_trajectory import reachable

from .engine.tool_path import ToolPath
from .inputs.pins_input import holding, pins_of
from .inputs.tissue_input import tissue_of, with_gravity
from .session import SimulationSession
from .ticker import Ticker


def nobody(*_arguments: Any) -> None:
    """Nobody listens."""


class SimulationEdits:
    """Edits of the session that OrganPhysSimulationLogic holds; all refuse what is wrong with an InputError."""

    session: SimulationSession | None
    running: bool
    _ticker: Ticker
    _needed: Callable[[], SimulationSession]
    _in_background: Callable[..., None]
    pause: Callable[[], None]

    def setJoints(self, joints: Sequence[float], *, jawDeg: float) -> None:
        """Send the arm to joints: yaw, pitch (rad), insertion (m), roll, wrist pitch, wrist yaw (rad)."""
        self._needed().aim_joints(np.asarray(joints, dtype=float), jawDeg)

    def setTissue(self, tissue: str = "", youngsKpa: float = 0.0) -> None:
        """Another tissue, or another stiffness in kPa, from now on; undo and recording begin anew."""
        live = self._needed().live
        live.set_tissue(tissue_of(tissue, youngsKpa, live.prepared.organ.name))

    def setGravity(self, direction: Sequence[float] | None) -> None:
        """Standard gravity along a direction (3,) of the scene, None: none."""
        live = self._needed().live
        live.set_options(with_gravity(live.options, None if direction is None else np.asarray(direction, dtype=float)))

    def setPins(
        self,
        pinsNode: Any,
        boxNode: Any = None,
        *,
        radiusMm: float = 20.0,
        onDone: Callable[[], None] | None = None,
        onFailed: Callable[[Exception], None] = nobody,
    ) -> None:
        """Other pins from now on, computed here (``onDone`` None) or beside the window while the stepping rests."""
        session = self._needed()
        pins = pins_of(pinsNode, boxNode, radiusMm, session.T_world_sim)
        surface = session.live.prepared.body.samples.vertices
        pins = holding(pins, surface)

        def exchange() -> None:
            session.live.mark()
            session.live.set_pins(pins)

        if onDone is None:
            exchange()
            session.show_pins(True)
            return
        was_running, speed = self.running, self._ticker.speed
        self.pause()

        def resumed(call: Callable[..., None], *arguments: Any) -> None:
            if self.session is session:
                session.show_pins(True)
                if was_running:
                    self._ticker.speed = speed
                    self._ticker.start(session)
                call(*arguments)

        done, failed = onDone, onFailed
        self._in_background(exchange, lambda _: resumed(done), lambda error: resumed(failed, error))

    def followTrajectory(self, path: str | Path) -> list[str]:
        """Let the tool follow a trajectory file (.csv, .json) from now on; warnings, e.g. about joint limits."""
        session = self._needed()
        live = session.live
        tool_path = ToolPath.of(read_trajectory(path), live.prepared.organ, live.time_s)
        reach = reachable(live.psm, tool_path.trajectory, near=live.arm.joints)
        session.path = tool_path
        return [notice.message for notice in reach.notices()]

    def warnings(self) -> list[str]:
        """What the user should know about the simulation as it is, in plain words."""
        return self._needed().live.warnings()
