"""Section 4: the instrument, by sliders, by the handle in the 3D view, or by a trajectory file."""

from __future__ import annotations

from typing import Any

import numpy as np
import qt
import slicer
from slicer.i18n import tr as _

from organphys.simulation.instruments import instrument_named
from OrganPhysRegistrationLib.panel.section import Section, guarded

JOINTS = ("yaw", "pitch", "insertion", "roll", "wristPitch", "wristYaw")
METRES = (False, False, True, False, False, False)
CLOSED_DEG, OPEN_DEG = -10.0, 40.0


class ToolSection(Section):
    """Sliders show where the arm is wanted, whoever moved it, and send it there when the user moves them."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        self._sliders = [getattr(ui, f"{name}Slider") for name in JOINTS]
        for slider in (*self._sliders, ui.jawSlider):
            slider.connect("valueChanged(double)", self.send)
        ui.jawButton.connect("clicked()", self.toggle_jaws)
        ui.trajectoryButton.connect("clicked()", self.choose_trajectory)
        self._showing = False
        self._session: Any = None
        self._instrument = ""

    def refresh(self) -> None:
        parameters, ui, session = self.panel.parameters, self.ui, self.panel.logic.session
        self._limit(parameters.instrument.value)
        ready = session is not None and not self.panel.logic.busy
        for widget in (*self._sliders, ui.jawSlider, ui.jawButton, ui.trajectoryButton):
            widget.enabled = ready
        if session is not None and session.live.psm.instrument.name != parameters.instrument.value:
            self.panel.logic.closeSimulation()
            self.panel.tell(_("Another instrument was chosen: press Start to prepare it."))
            self.panel.refresh_soon()
            return
        if session is not None:
            session.tool.show_handle(parameters.showHandle)
            if session is not self._session:
                session.place_handle()
        self._session = session
        self._show()

    def frame(self) -> None:
        """A frame was shown: the handle or a trajectory may have moved the arm."""
        self._show()

    @guarded
    def send(self) -> None:
        """The user moved a slider."""
        session = self.panel.logic.session
        if self._showing or session is None:
            return
        values = [slider.value for slider in self._sliders]
        joints = [value / 1e3 if metres else np.radians(value) for value, metres in zip(values, METRES, strict=True)]
        session.aim_joints(np.array(joints), self.ui.jawSlider.value)
        self._show()

    @guarded
    def toggle_jaws(self) -> None:
        """Close the jaws, or open them."""
        self.ui.jawSlider.value = OPEN_DEG if self.ui.jawSlider.value <= 0 else CLOSED_DEG

    @guarded
    def choose_trajectory(self) -> None:
        """Ask for a trajectory file and follow it."""
        kinds = _("Trajectory") + " (*.csv *.json)"
        path = qt.QFileDialog.getOpenFileName(slicer.util.mainWindow(), _("Load trajectory"), "", kinds)
        if path:
            self.follow(path)

    def follow(self, path: str) -> None:
        """Let the tool follow a trajectory file from now on."""
        warnings = self.panel.logic.followTrajectory(path)
        text = _("The instrument follows the trajectory. Moving a slider takes it over again.")
        self.panel.tell(warnings or text, "warning" if warnings else "info")

    def _show(self) -> None:
        ui, session = self.ui, self.panel.logic.session
        ui.limitLabel.visible = False
        if session is None:
            return
        wanted, limits = session.live.wanted, session.live.limits
        self._showing = True
        try:
            for slider, value, metres in zip(self._sliders, wanted.joints, METRES, strict=True):
                slider.value = float(1e3 * value if metres else np.degrees(value))
            ui.jawSlider.value = wanted.jaw_deg
        finally:
            self._showing = False
        closed = wanted.jaw_deg <= 0
        ui.jawButton.text = _("Open jaws (J)") if closed else _("Close jaws (J)")
        ui.jawButton.shortcut = qt.QKeySequence("J")  # a new text takes it away
        if limits:
            names = ", ".join(name.replace("_", " ") for name in limits)
            ui.limitLabel.text = _("Beyond the instrument's reach: {names} at its limit.").format(names=names)
            ui.limitLabel.visible = True

    def _limit(self, name: str) -> None:
        """Ranges of the sliders."""
        if name == self._instrument:
            return
        self._instrument, instrument = name, instrument_named(name)
        self._showing = True
        try:
            for slider, (low, high), metres in zip(self._sliders, instrument.limits, METRES, strict=True):
                factor = 1e3 if metres else 180 / np.pi
                slider.minimum, slider.maximum = float(factor * low), float(factor * high)
            self.ui.jawSlider.minimum, self.ui.jawSlider.maximum = instrument.jaw
        finally:
            self._showing = False
