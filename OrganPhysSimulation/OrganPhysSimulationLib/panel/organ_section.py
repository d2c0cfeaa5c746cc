"""Section 1: organ, splat, sample data and the endoscope's view."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.inputs.camera_input import look_from_endoscope
from OrganPhysRegistrationLib.inputs.matrices import ROLE
from OrganPhysRegistrationLib.panel.section import Section, guarded

from ..inputs.organ_input import ORGAN_ROLE, splat_of_organ
from ..inputs.sample_organ import SampleOrgan, SampleRun


class OrganSection(Section):
    """An organ chosen brings its splat along; a change of either ends a simulation."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        ui.organSelector.addAttribute("vtkMRMLModelNode", ROLE, ORGAN_ROLE)
        ui.splatSelector.addAttribute("vtkMRMLModelNode", "OrganPhys.Splat", "1")
        ui.loadOrganButton.connect("clicked()", self.choose_file)
        ui.sampleDataButton.connect("clicked()", self.take_sample)
        ui.endoscopeViewButton.connect("clicked()", self.look_from_endoscope)
        self._chosen: tuple[Any, Any] = (None, None)
        self._sample: SampleRun | None = None

    def bind(self) -> None:
        self._give_up()
        parameters = self.panel.parameters
        self._chosen = (None, None) if parameters is None else (parameters.organ, parameters.splat)

    def refresh(self) -> None:
        parameters, ui, logic = self.panel.parameters, self.ui, self.panel.logic
        chosen = (parameters.organ, parameters.splat)
        if chosen[0] is not self._chosen[0] and chosen[0] is not None and chosen[1] is None:
            chosen = (chosen[0], splat_of_organ(chosen[0]))
            parameters.splat = chosen[1]
        if chosen != self._chosen:
            self._chosen = chosen
            if logic.session is not None:
                logic.closeSimulation()
                self.panel.tell(_("Another organ or splat was chosen: the simulation has ended."))
        free = self._sample is None and not logic.busy
        for widget in (ui.organSelector, ui.splatSelector, ui.loadOrganButton, ui.sampleDataButton):
            widget.enabled = free and not logic.running
        ui.endoscopeViewButton.enabled = parameters.splat is not None

    def cleanup(self) -> None:
        self._give_up()
        super().cleanup()

    @guarded
    def choose_file(self) -> None:
        """Ask for an .organphys file and choose its organ."""
        kinds = _("Registered organ") + " (*.organphys)"
        path = qt.QFileDialog.getOpenFileName(slicer.util.mainWindow(), _("Load registered organ"), "", kinds)
        if path:
            self.panel.parameters.organ = self.panel.logic.loadOrgan(path)
            self.panel.tell("")

    @guarded
    def take_sample(self) -> None:
        """Load and register the sample case in the background, then choose it."""
        self.panel.logic.closeSimulation()
        self.panel.tell(_("The sample case is made, loaded and registered; this takes some ten seconds."))
        self.ui.progressBar.visible = True
        with slicer.util.WaitCursor():
            self._sample = SampleRun(self._sample_ready, self._sample_failed, self._sample_progress)
        self.panel.refresh()

    @guarded
    def look_from_endoscope(self) -> None:
        """Put the camera of the first 3D view where the endoscope was."""
        widget = slicer.app.layoutManager().threeDWidget(0)
        if widget is None:
            raise InputError(_("There is no 3D view: choose a layout with one first."))
        view = widget.mrmlViewNode()
        view.SetBoxVisible(False)  # seen from within, box and letters hang before the organ
        view.SetAxisLabelsVisible(False)
        look_from_endoscope(self.panel.parameters.splat, view, position=None, fov_deg=0.0)

    def _sample_progress(self, stage: str, fraction: float) -> None:
        self.ui.progressBar.maximum = 100
        self.ui.progressBar.value = round(100 * fraction)
        self.ui.progressBar.format = _("Registering the sample case – {percent} %").format(
            percent=round(100 * fraction)
        )

    def _sample_ready(self, nodes: SampleOrgan) -> None:
        self._end_sample()
        if self.panel.parameters is not None:
            self.panel.choose({"organ": nodes.organ, "splat": nodes.splat, "pins": nodes.pins})
            self.panel.tell(_("The sample liver is ready, with pins at its back: press Start."), "good")
            self.look_from_endoscope()

    def _sample_failed(self, message: str) -> None:
        self._end_sample()
        self.panel.tell(message, "error")

    def _end_sample(self) -> None:
        self._sample = None
        self.ui.progressBar.visible = False
        self.ui.progressBar.maximum = 0
        self.panel.refresh_soon()

    def _give_up(self) -> None:
        sample, self._sample = self._sample, None
        if sample is not None:
            sample.give_up()
            self.ui.progressBar.visible = False
