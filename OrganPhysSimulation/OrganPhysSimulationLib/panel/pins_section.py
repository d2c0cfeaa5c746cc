"""Section 2, second part: pins, which may be moved while the simulation runs."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from OrganPhysRegistrationLib.panel.section import Section, guarded, tell_failure

from ..inputs.pins_input import placed_box, placed_points

SETTLED_MS = 500  # after the last move of a pin


class PinsSection(Section):
    """A change of the pins is computed beside the window; the simulation rests meanwhile and goes on then."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        ui.pinsPlaceWidget.placeMultipleMarkups = slicer.qSlicerMarkupsPlaceWidget.ForcePlaceMultipleMarkups
        ui.addPinsButton.connect("clicked()", self.place_first)
        ui.suggestPinsButton.connect("clicked()", self.suggest)
        self._observed: list[Any] = [None, None]
        self._applied: tuple[Any, ...] = ()
        self._session: Any = None
        self._slot = self._apply
        self._timer = qt.QTimer()
        self._timer.setSingleShot(True)
        self._timer.setInterval(SETTLED_MS)
        self._timer.connect("timeout()", self._slot)

    def bind(self) -> None:
        self._timer.stop()
        self._observe(0, None)
        self._observe(1, None)

    def refresh(self) -> None:
        parameters, ui = self.panel.parameters, self.ui
        self._observe(0, parameters.pins)
        self._observe(1, parameters.pinBox)
        ui.pinsPlaceWidget.setCurrentNode(parameters.pins)
        ui.addPinsButton.visible = parameters.pins is None
        ui.pinsPlaceWidget.visible = parameters.pins is not None
        ui.suggestPinsButton.enabled = parameters.organ is not None
        session = self.panel.logic.session
        if session is not self._session:
            self._session, self._applied = session, self._choice()
        elif session is not None and self._choice() != self._applied:
            self._timer.start()

    def cleanup(self) -> None:
        self._timer.stop()
        super().cleanup()

    @guarded
    def place_first(self) -> None:
        """Make a list of pins and start placing."""
        name = slicer.mrmlScene.GenerateUniqueName(_("Organ pins"))
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", name)
        node.CreateDefaultDisplayNodes()
        self.panel.parameters.pins = node
        self.panel.refresh()
        self.ui.pinsPlaceWidget.setPlaceModeEnabled(True)

    @guarded
    def suggest(self) -> None:
        """Three pins at the back of the organ."""
        parameters = self.panel.parameters
        pins = self.panel.logic.suggestPins(parameters.organ, parameters.splat, pinsNode=parameters.pins)
        parameters.pins = pins

    def _choice(self) -> tuple[Any, ...]:
        parameters = self.panel.parameters
        places = tuple(tuple(place.round(3)) for place in placed_points(parameters.pins))
        box = placed_box(parameters.pinBox)
        numbers = () if box is None else (*box[0].ravel().round(3), *box[1].round(3))
        return places, parameters.pinRadiusMm if places else 0.0, tuple(map(float, numbers))

    @guarded
    def _apply(self) -> None:
        logic, parameters = self.panel.logic, self.panel.parameters
        if parameters is None or logic.session is None:
            return
        if logic.busy or (parameters.pins is not None and in_hand(parameters.pins)):
            self._timer.start()
            return
        self._applied = self._choice()
        self.panel.tell(_("The pins are being changed; the simulation rests meanwhile."))
        logic.setPins(
            parameters.pins,
            parameters.pinBox,
            radiusMm=parameters.pinRadiusMm,
            onDone=self._done,
            onFailed=lambda error: self._failed(error),
        )
        self.panel.refresh_soon()

    def _done(self) -> None:
        self.panel.tell(self.panel.logic.warnings(), "warning")
        self.panel.refresh_soon()

    def _failed(self, error: Exception) -> None:
        tell_failure(self.panel, "change of pins", error)
        self.panel.refresh_soon()

    def _observe(self, which: int, node: Any) -> None:
        before = self._observed[which]
        if node is before:
            return
        kinds = slicer.vtkMRMLMarkupsNode
        for event in (kinds.PointPositionDefinedEvent, kinds.PointRemovedEvent, kinds.PointModifiedEvent):
            if before is not None:
                self.removeObserver(before, event, self.panel.refresh_soon)
            if node is not None:
                self.addObserver(node, event, self.panel.refresh_soon)
        self._observed[which] = node


def in_hand(node: Any) -> bool:
    """Whether a control point is being placed right now."""
    preview = slicer.vtkMRMLMarkupsNode.PositionPreview
    states = [node.GetNthControlPointPositionStatus(k) for k in range(node.GetNumberOfControlPoints())]
    return len(states) > 0 and all(state == preview for state in states)
