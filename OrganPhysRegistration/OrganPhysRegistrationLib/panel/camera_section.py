"""Section 1, last part: where the endoscope stood, and the layout of the views."""

from __future__ import annotations

import json
from typing import Any

import slicer
from slicer.i18n import tr as _

from organphys.ground.checks import InputError

from ..choices import CameraChoice
from ..runs.run_inputs import camera_position_of
from .section import Section, guarded
from .view_layout import show_layout


class CameraSection(Section):
    """Takes the endoscope's place from the 3D view, and puts the 3D view there."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self.ui.useViewButton.connect("clicked()", self.use_view)
        self.ui.endoscopeViewButton.connect("clicked()", self.look_from_endoscope)
        self.ui.layoutButton.connect("clicked()", self.show_layout)

    def refresh(self) -> None:
        parameters, ui = self.panel.parameters, self.ui
        has_splat = parameters.splat is not None
        ui.useViewButton.enabled = ui.endoscopeViewButton.enabled = has_splat
        from_view = parameters.cameraChoice is CameraChoice.FromView
        ui.cameraFactLabel.visible = from_view
        if not from_view:
            return
        try:
            x, y, z = camera_position_of(parameters.cameraPosition)
        except InputError:  # none yet; problems of a run tells what is wrong with another one
            ui.cameraFactLabel.text = _("Turn the 3D view to where the endoscope looked from, then press Use 3D view.")
            return
        place, fov = f"{x:.3g}, {y:.3g}, {z:.3g}", parameters.cameraFovDeg
        angle = _("view angle {fov:.0f}°").format(fov=fov) if fov else _("view angle not known")
        ui.cameraFactLabel.text = _("Endoscope at {place} scene units, {angle}").format(place=place, angle=angle)

    @guarded
    def use_view(self) -> None:
        """The camera of the first 3D view is the endoscope from now on."""
        from ..inputs.camera_input import camera_from_view

        parameters = self.panel.parameters
        position, fov_deg = camera_from_view(parameters.splat, self._view_node())
        parameters.cameraPosition = json.dumps([float(x) for x in position])
        parameters.cameraFovDeg = float(fov_deg)
        parameters.cameraChoice = CameraChoice.FromView
        self.panel.tell("")

    @guarded
    def look_from_endoscope(self) -> None:
        """Put the camera of the first 3D view where the endoscope is taken to be."""
        from ..inputs.camera_input import look_from_endoscope

        parameters = self.panel.parameters
        position = None
        if parameters.cameraChoice is CameraChoice.FromView:
            position = camera_position_of(parameters.cameraPosition)
        view = self._view_node()
        view.SetBoxVisible(False)  # seen from within, box and letters hang before the organ
        view.SetAxisLabelsVisible(False)
        look_from_endoscope(parameters.splat, view, position=position, fov_deg=parameters.cameraFovDeg)

    @guarded
    def show_layout(self) -> None:
        """CT slices and the 3D overlay side by side."""
        show_layout()

    def _view_node(self) -> Any:
        widget = slicer.app.layoutManager().threeDWidget(0)
        if widget is None:
            raise InputError(_("There is no 3D view: choose the CT and 3D layout first."))
        return widget.mrmlViewNode()
