"""Section 3: preparing, starting, pausing, stepping, going back."""

from __future__ import annotations

from typing import Any

import numpy as np
from slicer.i18n import tr as _

from organphys.ground.checks import InputError
from organphys.simulation.options import gravity_along
from OrganPhysRegistrationLib.panel.section import Section, guarded, tell_failure

from ..choices import GravityChoice
from ..inputs.organ_input import organ_of
from .tissue_section import by_patient


class RunSection(Section):
    """Start prepares the simulation where there is none, then runs it; Start becomes Pause, or Cancel meanwhile."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        ui.startButton.connect("clicked()", self.start)
        ui.stepButton.connect("clicked()", self.step)
        ui.resetButton.connect("clicked()", self.reset)
        ui.undoButton.connect("clicked()", self.undo)

    def refresh(self) -> None:
        ui, logic, parameters = self.ui, self.panel.logic, self.panel.parameters
        busy, running, session = logic.busy, logic.running, logic.session
        preparing = busy and session is None
        ui.startButton.text = _("Cancel") if preparing else _("Pause") if running else _("Start")
        ui.startButton.enabled = preparing or (parameters.organ is not None and not busy)
        tip = _("Choose an organ first, or take the sample data.")
        ui.startButton.toolTip = tip if parameters.organ is None else _("Prepare the simulation if needed, and run it.")
        if busy:
            ui.progressBar.maximum = 0
            ui.progressBar.visible = True
            ui.progressBar.format = ""
        elif ui.progressBar.maximum == 0:
            ui.progressBar.visible = False
        rests = session is not None and not running and not busy
        ui.stepButton.enabled = ui.startButton.enabled and not running and not busy
        ui.resetButton.enabled = session is not None and not busy
        ui.undoButton.enabled = rests and session.live.can_undo
        logic.setSpeed(parameters.speed)

    @guarded
    def start(self) -> None:
        """Start, pause, or give a preparation up."""
        logic = self.panel.logic
        if logic.busy and logic.session is None:
            logic.closeSimulation()
            self.panel.tell(_("The preparation was given up."))
        elif logic.running:
            logic.pause()
        elif logic.session is None:
            self._prepare(self._run)
        else:
            self._run()
        self.panel.refresh()

    @guarded
    def step(self) -> None:
        """One step; prepares the simulation where there is none."""
        logic = self.panel.logic
        if logic.session is None:
            self._prepare(self._step)
        else:
            self._step()
        self.panel.refresh()

    @guarded
    def reset(self) -> None:
        """The registered shape again, the instrument withdrawn; a run goes on from there."""
        self.panel.logic.reset()
        self._shown()

    @guarded
    def undo(self) -> None:
        """Back to before the last start, step or change of pins."""
        self.panel.logic.undo()
        self._shown()

    def _run(self) -> None:
        logic, parameters = self.panel.logic, self.panel.parameters
        logic.run(speed=parameters.speed)
        self.panel.tell(logic.warnings(), "warning")

    def _step(self) -> None:
        logic = self.panel.logic
        logic.session.live.mark()
        logic.step()
        self._shown()

    def _shown(self) -> None:
        self.panel.tell(self.panel.logic.warnings(), "warning")
        self.panel.show_frame()
        self.panel.refresh()

    def _prepare(self, then: Any) -> None:
        parameters = self.panel.parameters
        if parameters.organ is None:
            raise InputError(_("organ: none chosen; choose a registered organ or take the sample data"))
        self.panel.tell(_("The simulation is being prepared; this takes some seconds."))
        self.panel.logic.prepare(
            lambda: self._ready(then),
            self._failed,
            organ_node=parameters.organ,
            splat=parameters.splat,
            pins=parameters.pins,
            box=parameters.pinBox,
            pin_radius_mm=parameters.pinRadiusMm,
            tissue=parameters.tissue.value,
            youngs_kpa=parameters.youngsKpa,
            gravity=self._gravity(),
            instrument=parameters.instrument.value,
            detail=parameters.detail,
        )

    def _gravity(self) -> Any:
        """m/s^2 (3,) along the scene's axes at the start; the arrow is drawn afterwards."""
        parameters = self.panel.parameters
        if not parameters.gravity:
            return None
        choice = parameters.gravityChoice
        choice = GravityChoice.Supine if choice is GravityChoice.Arrow else choice
        return np.asarray(gravity_along(by_patient(organ_of(parameters.organ), choice)))

    @guarded
    def _ready(self, then: Any) -> None:
        self.panel.refresh()  # the other sections learn of the session first
        then()
        self.panel.refresh()

    def _failed(self, error: Exception) -> None:
        tell_failure(self.panel, "preparing the simulation", error)
        self.panel.refresh()
