"""Section 5: what is drawn."""

from __future__ import annotations

from typing import Any

import vtk
from slicer.i18n import tr as _

from OrganPhysRegistrationLib.panel.section import Section, guarded

from ..views.gaussian_actor import drawn_as


class DisplaySection(Section):
    """Splat, surface, pins, colours of the surface."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self._shown: tuple[Any, ...] = ()

    def bind(self) -> None:
        self._shown = ()

    def refresh(self) -> None:
        session, parameters, ui = self.panel.logic.session, self.panel.parameters, self.ui
        ui.showSplatCheck.enabled = parameters.splat is not None
        version = vtk.vtkVersion.GetVTKVersion()
        notes = {
            "ellipsoids": "",
            "balls": _("VTK {version} draws Gaussians round; with VTK 9.4 or later they have their shapes."),
            "points": _("VTK {version} has no mapper for Gaussians: they are drawn as points."),
        }
        ui.displayNote.text = notes[drawn_as()].format(version=version)
        ui.displayNote.visible = bool(ui.displayNote.text)
        self._apply(session)

    @guarded
    def _apply(self, session: Any) -> None:
        parameters = self.panel.parameters
        wanted = (session, parameters.showSplat, parameters.showSurface, parameters.showPins, parameters.colouring)
        before, self._shown = self._shown, wanted
        if session is None or wanted == before:
            return
        known = before if before and before[0] is session else (None,) * len(wanted)
        with_splat = parameters.showSplat and session.splat_view is not None
        if wanted[1:3] != known[1:3]:
            session.show_splat(parameters.showSplat)
            session.show_surface(parameters.showSurface and not (with_splat and self._plain()))
        if wanted[3] != known[3]:
            session.show_pins(parameters.showPins)
        if wanted[4] != known[4]:
            session.colour_by(parameters.colouring)
            session.show_surface(parameters.showSurface and not (with_splat and self._plain()))

    def _plain(self) -> bool:
        """Whether the surface would only hide the splat: it has no colours to show."""
        return not self.panel.parameters.colouring.value
