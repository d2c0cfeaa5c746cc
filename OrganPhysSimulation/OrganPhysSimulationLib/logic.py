"""OrganPhysSimulationLogic: the module without its panel, for the Python console, scripts and tests.

A script starts a simulation, steps it and takes figures and files:

    logic = OrganPhysSimulationLogic()
    logic.startSimulation(organNode, splatNode, pinsNode=pins, tissue="liver")
    logic.setJoints([0, 0, 0.1, 0, 0, 0], jawDeg=-5)
    reading = logic.step(60)

Lengths are mm, angles degrees, forces N unless a name says otherwise; what is wrong with an input is an InputError.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from slicer.ScriptedLoadableModule import ScriptedLoadableModuleLogic

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.dependencies import ensure_packages
from OrganPhysRegistrationLib.inputs.splat_node import T_shown_scene

from .background import Background
from .engine.live_simulation import DT, LiveSimulation
from .engine.readings import Reading
from .inputs.organ_input import case_of_organ, load_organ, organ_of, splat_of_organ
from .inputs.suggested_pins import upright, write_pins
from .logic_edits import SimulationEdits, nobody
from .logic_files import SimulationFiles
from .roles import remove_all
from .runs import StartInputs, gathered
from .scene_guard import SceneGuard
from .session import SimulationSession
from .ticker import Ticker


class OrganPhysSimulationLogic(SimulationEdits, SimulationFiles, ScriptedLoadableModuleLogic):
    """At most one simulation at a time: ``session``, None before it is prepared and after it is closed.

    ``onFrame``, ``onStopped(reason)``: called after every shown frame, and when stepping stopped by itself.
    ``fineness``: handles and quadrature points of simulations to come, where not 20 and 2000.
    """

    def __init__(self, parent: Any = None) -> None:
        ScriptedLoadableModuleLogic.__init__(self, parent)
        self.moduleName = "OrganPhysSimulation"  # the parameter node carries it, whatever the class is called
        self.session: SimulationSession | None = None
        self.fineness: dict[str, int] = {}
        self.onFrame: Callable[[], None] = nobody
        self.onStopped: Callable[[str], None] = nobody
        self._work: Background | None = None
        self._ticker = Ticker(self._framed, self._failed)
        self._guard: SceneGuard | None = None

    # making and ending

    def loadOrgan(self, path: str | Path) -> Any:
        """Load an .organphys file as a (hidden) model node that can be simulated."""
        ensure_packages()
        return load_organ(path)

    def suggestPins(self, organNode: Any, splatNode: Any = None, *, pinsNode: Any = None) -> Any:
        """A point list (``pinsNode``, or a new one) with three pins at the back of the organ, away from the camera."""
        organ = organ_of(organNode)
        splat = splat_of_organ(organNode) if splatNode is None else splatNode
        return write_pins(pinsNode, organ, upright(organ) if splat is None else T_shown_scene(splat))

    def startSimulation(
        self,
        organNode: Any,
        splatNode: Any = None,
        *,
        pinsNode: Any = None,
        pinBoxNode: Any = None,
        pinRadiusMm: float = 20.0,
        tissue: str = "",
        youngsKpa: float = 0.0,
        gravity: Sequence[float] | None = None,
        instrument: str = "large_needle_driver",
        detail: bool = False,
        **fineness: int,
    ) -> SimulationSession:
        """Prepare a simulation here and now (seconds); step it with ``step`` or let it ``run``.

        organNode: the registration's "displaced volume points" or ``loadOrgan``'s node; splatNode None: the splat the
        organ was registered onto, if any; tissue "": by the organ's name; youngsKpa 0: the tissue's own; gravity (3,):
        m/s^2 along the scene's axes; detail: local functions where the tool touches; fineness: handles, quadrature.
        """
        inputs = self._gathered(
            organNode,
            splatNode,
            pins=pinsNode,
            box=pinBoxNode,
            pin_radius_mm=pinRadiusMm,
            tissue=tissue,
            youngs_kpa=youngsKpa,
            gravity=None if gravity is None else np.asarray(gravity, dtype=float),
            instrument=instrument,
            detail=detail,
            **fineness,
        )
        try:
            live = inputs.built()
        except InputError:
            remove_all()
            raise
        return self._begin(live, organNode, splatNode)

    def prepare(self, onReady: Callable[[], None], onFailed: Callable[[Exception], None], **inputs: Any) -> None:
        """As ``startSimulation``, beside Slicer's window; inputs: see ``runs.gathered``."""
        organ, splat = inputs.pop("organ_node"), inputs.pop("splat")
        gathered_inputs = self._gathered(organ, splat, **inputs)

        def done(live: LiveSimulation) -> None:
            self._begin(live, organ, splat)
            onReady()

        def failed(error: Exception) -> None:
            self.closeSimulation()
            onFailed(error)

        self._in_background(gathered_inputs.built, done, failed)
        self._guard = SceneGuard([organ, splat], on_left=self._left, on_closing=self._scene_closing)

    def closeSimulation(self) -> None:
        """Stop and remove what the simulation put into scene and views; recordings stay."""
        self._drop_work()
        self._ticker.abandon()
        session, self.session = self.session, None
        if self._guard is not None:
            self._guard.remove()
            self._guard = None
        if session is not None:
            session.close()
        else:
            remove_all()  # what a preparation that was given up had made

    cleanup = closeSimulation

    # running

    @property
    def running(self) -> bool:
        """Whether the timer steps the simulation."""
        return self._ticker.running

    @property
    def busy(self) -> bool:
        """Whether something is being prepared in the background."""
        return self._work is not None and self._work.running

    @property
    def pace(self) -> float:
        """Simulated seconds per second reached while running."""
        return self._ticker.pace

    def run(self, *, speed: float = 1.0) -> None:
        """Let the timer step the simulation at ``speed`` simulated seconds per second."""
        session = self._needed()
        if not self.running:
            session.live.mark()
            self._ticker.speed = speed
            self._ticker.start(session)

    def setSpeed(self, speed: float) -> None:
        """Another speed while it runs."""
        self._ticker.speed = speed

    def pause(self) -> None:
        """Stop the timer; the simulation stays as it is."""
        self._ticker.stop()

    def step(self, count: int = 1, *, dt: float = DT) -> Reading:
        """``count`` steps of ``dt`` s here and now; the reading after the last."""
        session = self._needed()
        for _ in range(count):
            session.step(dt)
        session.publish()
        return session.live.readings.last

    def undo(self) -> None:
        """Back to before the last start, step or change of pins. InputError: there is nothing to undo."""
        self._needed().undo()

    def reset(self) -> None:
        """Back to the beginning."""
        self._needed().reset()

    # inner

    def _needed(self) -> SimulationSession:
        if self.session is None:
            raise InputError("simulation: none is prepared; press Start, or call startSimulation")
        if self.busy:
            doing = "changing its pins" if self.sequence is None else "writing its splat"
            raise InputError(f"simulation: busy {doing}; wait until that is done")
        return self.session

    def _gathered(self, organ: Any, splat: Any, **inputs: Any) -> StartInputs:
        ensure_packages()
        self.closeSimulation()
        try:
            return gathered(organ, splat_of_organ(organ) if splat is None else splat, **{**self.fineness, **inputs})
        except InputError:
            remove_all()
            raise

    def _begin(self, live: LiveSimulation, organ: Any, splat: Any) -> SimulationSession:
        splat = splat_of_organ(organ) if splat is None else splat
        if self._guard is not None:
            self._guard.remove()
        self.session = SimulationSession(live, splat, case_of_organ(organ))
        self._guard = SceneGuard([organ, splat], on_left=self._left, on_closing=self._scene_closing)
        return self.session

    def _in_background(self, work: Any, done: Any, failed: Any) -> None:
        if self.busy:
            raise InputError("simulation: something is being prepared; wait until it is done")
        self._work = Background(work, on_done=done, on_error=failed)

    def _drop_work(self) -> None:
        self.cancelSequence()
        self._sequence = None
        if self._work is not None:
            self._work.drop()
            self._work = None

    def _framed(self) -> None:
        self.onFrame()

    def _failed(self, error: Exception) -> None:
        self.onStopped(str(error) or type(error).__name__)

    def _left(self, name: str) -> None:
        self.closeSimulation()
        self.onStopped(f"{name} was removed from the scene; the simulation has ended")

    def _scene_closing(self) -> None:
        self.closeSimulation()
        self.onStopped("")
