"""The panel as a whole: its sections and what they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import qt
import slicer
import vtk
from slicer.util import NodeModify, VTKObservationMixin

from ..choices import OverlayIn, Stage
from ..inputs.splat_removal import SplatRemoval
from ..outputs.case_nodes import CaseNodes, case_of
from ..outputs.overlay_frame import overlay_in, set_overlay
from ..outputs.stage_switch import shown_stage
from ..parameters import OrganPhysRegistrationParameterNode
from .message_box import show_message
from .section import Section, tell_failure

PARAMETER = "SlicerParameterName"  # dynamic property of a widget in the .ui: the parameter it shows


class Panel(VTKObservationMixin):
    """``ui``: widgets of the .ui by name; ``logic``: OrganPhysRegistrationLogic.

    ``parameters`` is None while a scene is closed or loaded. ``sections`` are refreshed together, once per turn of the
    event loop, after any parameter has changed.
    """

    def __init__(self, ui: Any, logic: Any) -> None:
        VTKObservationMixin.__init__(self)
        self.ui, self.logic = ui, logic
        self.parameters: OrganPhysRegistrationParameterNode | None = None
        self.sections: list[Section] = []
        self._case: CaseNodes | None = None
        self._organ: tuple[Any, ...] = ()
        self._gui_tag: int | None = None
        self._timer = qt.QTimer()
        self._timer.setSingleShot(True)
        self._timer.setInterval(0)
        self._timer.connect("timeout()", self.refresh)
        self.addObserver(slicer.mrmlScene, slicer.vtkMRMLScene.NodeRemovedEvent, self.refresh_soon)
        self._splat_removal = SplatRemoval()

    def connect_parameters(self, parameters: OrganPhysRegistrationParameterNode | None) -> None:
        """Bind the widgets to other parameters, or to none."""
        if self.parameters is not None:
            self.parameters.disconnectGui(self._gui_tag)
            self.removeObserver(self.parameters.parameterNode, vtk.vtkCommand.ModifiedEvent, self.refresh_soon)
        self.parameters, self._case, self._organ = parameters, None, ()
        if parameters is not None:
            self._gui_tag = parameters.connectParametersToGui(self._widgets_of_parameters())
            self.addObserver(parameters.parameterNode, vtk.vtkCommand.ModifiedEvent, self.refresh_soon)
        else:
            self.tell("")  # it was about what is gone
        for section in self.sections:
            section.bind()
        self.refresh()

    def refresh(self) -> None:
        """Show the present state in every section."""
        if self.parameters is None:
            return
        self._follow_organ()
        self._case = CaseNodes.find(case_id=self.parameters.caseID) if self.parameters.caseID else None
        for section in self.sections:
            self._refresh_section(section)

    def refresh_soon(self, *_event: Any) -> None:
        """Refresh in the next turn of the event loop, however often this is called until then."""
        self._timer.start()

    def tell(self, lines: str | Sequence[str], kind: str = "info") -> None:
        """Tell the user something beside the Register button; ``kind``: "info", "good", "warning" or "error"."""
        show_message(self.ui.messageLabel, lines, kind)

    def tell_warnings(self, case: CaseNodes | None) -> bool:
        """Tell the warnings of a case in plain words; False, and nothing is told, if it has none."""
        warnings = [] if case is None else [message for _code, message in case.record["notices"]]
        self.tell(warnings, "warning")
        return bool(warnings)

    def choose(self, nodes: Mapping[str, Any]) -> None:
        """Set several parameters at once: name -> value."""
        with NodeModify(self.parameters.parameterNode):
            for name, value in nodes.items():
                setattr(self.parameters, name, value)

    def leave(self) -> None:
        """The user goes to another module: point placing ends, a run goes on."""
        for widget in (self.ui.landmarksPlaceWidget, self.ui.splatLandmarksPlaceWidget):
            widget.setPlaceModeEnabled(False)

    def case(self) -> CaseNodes | None:
        """The case whose results are shown, as of the last refresh."""
        return self._case

    def adopt(self, case: CaseNodes | None) -> None:
        """Show the results of this case from now on, None: of none."""
        if case is None:
            self.choose({"caseID": ""})
        else:
            shown, where = Stage(shown_stage(case)), OverlayIn(overlay_in(case))
            self.choose({"caseID": case.case_id, "shownStage": shown, "overlayIn": where})

    def adopt_chosen(self) -> CaseNodes | None:
        """Show the results of the chosen organ on the chosen splat, if there are any; that case."""
        chosen = self.parameters
        case = case_of(chosen.segmentation, chosen.segmentID, chosen.splat) if chosen.splat is not None else None
        self.adopt(case)
        if case is not None and overlay_in(case) == OverlayIn.CT.value:
            set_overlay(case, OverlayIn.CT.value)  # another organ on the same splat may lie there now
        return case

    def _refresh_section(self, section: Section) -> None:
        """One that fails leaves the others alive."""
        try:
            section.refresh()
        except Exception as error:
            tell_failure(self, f"refresh of {type(section).__name__}", error)

    def _follow_organ(self) -> None:
        """Another organ or splat was chosen: show its results, if it has been registered already."""
        chosen = self.parameters
        organ = (chosen.segmentation, chosen.segmentID, chosen.splat)
        if organ == self._organ or not all(organ):
            return
        self._organ = organ
        self.tell_warnings(self.adopt_chosen())

    def cleanup(self) -> None:
        """Let go of everything that is observed."""
        self.connect_parameters(None)
        self._timer.stop()
        self._splat_removal.remove()
        for section in self.sections:
            section.cleanup()
        self.removeObservers()

    def _widgets_of_parameters(self) -> dict[str, Any]:
        widgets = {widget.property(PARAMETER): widget for widget in vars(self.ui).values()}
        return {name: widget for name, widget in widgets.items() if name}
