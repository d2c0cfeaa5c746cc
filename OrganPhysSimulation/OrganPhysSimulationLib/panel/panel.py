"""The panel as a whole: its sections and what they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import qt
import slicer
import vtk
from slicer.util import NodeModify, VTKObservationMixin

from OrganPhysRegistrationLib.panel.message_box import show_message
from OrganPhysRegistrationLib.panel.section import Section, tell_failure

from ..parameters import OrganPhysSimulationParameterNode

PARAMETER = "SlicerParameterName"  # dynamic property of a widget in the .ui: the parameter it shows


class Panel(VTKObservationMixin):
    """``ui``: widgets of the .ui by name; ``logic``: OrganPhysSimulationLogic.

    ``parameters`` is None while a scene is closed or loaded. ``sections`` are refreshed together, once per turn of the
    event loop, after any parameter has changed; ``frame`` of those that have it is called with every shown frame.
    """

    def __init__(self, ui: Any, logic: Any) -> None:
        VTKObservationMixin.__init__(self)
        self.ui, self.logic = ui, logic
        self.parameters: OrganPhysSimulationParameterNode | None = None
        self.sections: list[Section] = []
        self._gui_tag: int | None = None
        self._slot = self.refresh  # PythonQt keeps no reference to a bound method
        self._timer = qt.QTimer()
        self._timer.setSingleShot(True)
        self._timer.setInterval(0)
        self._timer.connect("timeout()", self._slot)
        self.addObserver(slicer.mrmlScene, slicer.vtkMRMLScene.NodeRemovedEvent, self.refresh_soon)
        logic.onFrame, logic.onStopped = self.show_frame, self.stopped

    def connect_parameters(self, parameters: OrganPhysSimulationParameterNode | None) -> None:
        """Bind the widgets to other parameters, or to none."""
        if self.parameters is not None:
            self.parameters.disconnectGui(self._gui_tag)
            self.removeObserver(self.parameters.parameterNode, vtk.vtkCommand.ModifiedEvent, self.refresh_soon)
        self.parameters = parameters
        if parameters is not None:
            self._gui_tag = parameters.connectParametersToGui(self._widgets_of_parameters())
            self.addObserver(parameters.parameterNode, vtk.vtkCommand.ModifiedEvent, self.refresh_soon)
        else:
            self.tell("")  # it was about what is gone
        for section in self.sections:
            section.bind()
        self.refresh()

    def refresh(self) -> None:
        """Show the present state in every section; one that fails leaves the others alive."""
        if self.parameters is None:
            return
        for section in self.sections:
            self._refresh_section(section)

    def _refresh_section(self, section: Section) -> None:
        try:
            section.refresh()
        except Exception as error:
            tell_failure(self, f"refresh of {type(section).__name__}", error)

    def refresh_soon(self, *_event: Any) -> None:
        """Refresh in the next turn of the event loop, however often this is called until then."""
        self._timer.start()

    def show_frame(self) -> None:
        """A frame of the running simulation was shown."""
        for section in self.sections:
            frame = getattr(section, "frame", None)
            if frame is not None:
                frame()

    def stopped(self, reason: str) -> None:
        """The simulation stopped by itself."""
        self.tell(reason, "warning" if reason else "plain")
        self.refresh_soon()

    def tell(self, lines: str | Sequence[str], kind: str = "info") -> None:
        """Tell the user something below the Start button; ``kind``: "info", "good", "warning" or "error"."""
        show_message(self.ui.messageLabel, lines, kind)

    def choose(self, nodes: Mapping[str, Any]) -> None:
        """Set several parameters at once: name -> value."""
        with NodeModify(self.parameters.parameterNode):
            for name, value in nodes.items():
                setattr(self.parameters, name, value)

    def leave(self) -> None:
        """The user goes to another module: point placing ends and the simulation rests."""
        self.ui.pinsPlaceWidget.setPlaceModeEnabled(False)
        self.logic.pause()
        self.refresh()

    def cleanup(self) -> None:
        """Let go of everything that is observed."""
        self.connect_parameters(None)
        self._timer.stop()
        for section in self.sections:
            section.cleanup()
        self.removeObservers()

    def _widgets_of_parameters(self) -> dict[str, Any]:
        widgets = {widget.property(PARAMETER): widget for widget in vars(self.ui).values()}
        return {name: widget for name, widget in widgets.items() if name}
