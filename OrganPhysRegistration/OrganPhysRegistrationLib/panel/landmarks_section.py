"""Section 1, third part: landmarks on the seen part of the organ, and the weights that follow from them."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from ..inputs.landmark_input import (
    landmark_messages,
    landmark_points,
    organ_surface,
    show_weights,
    snap_to_surface,
)
from .message_box import show_message
from .section import Section, guarded

MOST_ROWS = 3  # of the table, before it scrolls


class LandmarksSection(Section):
    """Point list with its place button, names and radius; points snap to the organ's surface."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        ui.landmarksPlaceWidget.placeMultipleMarkups = slicer.qSlicerMarkupsPlaceWidget.ForcePlaceSingleMarkup
        ui.addLandmarksButton.connect("clicked()", self.place_first)
        header = ui.landmarksTable.horizontalHeader()
        header.setStretchLastSection(True)
        ui.landmarksTable.setHorizontalHeaderLabels([_("Landmark"), _("R, A, S (mm)")])
        ui.landmarksTable.verticalHeader().hide()
        ui.landmarksTable.connect("cellChanged(int,int)", self._name_edited)
        ui.showWeightsButton.connect("toggled(bool)", self._toggle_weights)
        self._node: Any = None
        self._snapped: tuple[Any, str, Any] | None = None
        self._snapping: Any = None
        self._surface: Any = None
        self._checked: tuple[Any, ...] = ()
        self._messages: list[str] = []
        self._weights: Any = None
        self._weighted: tuple[Any, ...] = ()
        self._filling = False

    def bind(self) -> None:
        self._stop_snapping()
        self._hide_weights()
        self._observe(None)

    def refresh(self) -> None:
        parameters = self.panel.parameters
        self._observe(parameters.landmarks)
        self.ui.landmarksPlaceWidget.setCurrentNode(parameters.landmarks)
        self.ui.addLandmarksButton.visible = parameters.landmarks is None
        self.ui.landmarksPlaceWidget.visible = parameters.landmarks is not None
        self._snap()
        self._fill_table()
        self._tell_messages()
        radius = parameters.landmarkRadiusMm
        self.ui.radiusSlider.suffix = " mm" if radius else " mm (" + _("auto") + ")"
        points = self._point_count()
        has_organ = parameters.segmentation is not None and bool(parameters.segmentID)
        self.ui.showWeightsButton.enabled = bool(points) and has_organ
        if not self.ui.showWeightsButton.enabled:
            self.ui.showWeightsButton.checked = False
        elif self._weights is not None:
            self._show_weights()

    def cleanup(self) -> None:
        self._stop_snapping()
        self._hide_weights()
        super().cleanup()

    @guarded
    def place_first(self) -> None:
        """Make a point list and start placing."""
        name = slicer.mrmlScene.GenerateUniqueName(_("Organ landmarks"))
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", name)
        node.CreateDefaultDisplayNodes()
        self.panel.parameters.landmarks = node
        self.panel.refresh()
        self.ui.landmarksPlaceWidget.setPlaceModeEnabled(True)

    def _observe(self, node: Any) -> None:
        if node is self._node:
            return
        events = (slicer.vtkMRMLMarkupsNode.PointPositionDefinedEvent, slicer.vtkMRMLMarkupsNode.PointRemovedEvent)
        events += (slicer.vtkMRMLMarkupsNode.PointEndInteractionEvent, slicer.vtkMRMLMarkupsNode.PointModifiedEvent)
        for event in events:
            if self._node is not None:
                self.removeObserver(self._node, event, self.panel.refresh_soon)
            if node is not None:
                self.addObserver(node, event, self.panel.refresh_soon)
        self._node = node

    def _point_count(self) -> int:
        return self._node.GetNumberOfDefinedControlPoints() if self._node is not None else 0

    def _fill_table(self) -> None:
        table, node = self.ui.landmarksTable, self._node
        count = node.GetNumberOfControlPoints() if node is not None else 0
        table.visible = count > 0
        self._filling = True
        try:
            table.setRowCount(count)
            for row in range(count):
                position = [0.0, 0.0, 0.0]
                node.GetNthControlPointPositionWorld(row, position)
                name, place = node.GetNthControlPointLabel(row), ", ".join(f"{x:.1f}" for x in position)
                for column, text in enumerate((name, place)):
                    if table.item(row, column) is None or table.item(row, column).text() != text:
                        table.setItem(row, column, qt.QTableWidgetItem(text))
            table.resizeRowsToContents()
            rows = sum(table.rowHeight(row) for row in range(min(count, MOST_ROWS)))
            table.setFixedHeight(rows + table.horizontalHeader().sizeHint.height() + 2 * table.frameWidth)
        finally:
            self._filling = False

    @guarded
    def _tell_messages(self) -> None:
        """What to do next, or what is wrong with the points."""
        if not self._point_count():
            hint = _("Place one or two points on the part of the organ that the endoscope sees.")
            show_message(self.ui.landmarksHintLabel, hint, "plain")
        else:
            places = (self._surface, landmark_points(self._node)[0].tobytes(), self._node.GetNumberOfControlPoints())
            if places != self._checked:
                self._checked = places
                self._messages = [] if self._surface is None else landmark_messages(self._node, self._surface)
            show_message(self.ui.landmarksHintLabel, self._messages, "warning")

    def _name_edited(self, row: int, column: int) -> None:
        if not self._filling and column == 0 and self._node is not None:
            self._node.SetNthControlPointLabel(row, self.ui.landmarksTable.item(row, 0).text())

    @guarded
    def _snap(self) -> None:
        """Snap to the organ that is chosen now."""
        parameters = self.panel.parameters
        wanted = (self._node, parameters.segmentID, parameters.segmentation)
        if wanted == self._snapped:
            return
        self._stop_snapping()
        self._snapped = wanted
        if None not in (self._node, parameters.segmentation) and parameters.segmentID:
            self._surface = organ_surface(parameters.segmentation, parameters.segmentID)
            self._snapping = snap_to_surface(self._node, self._surface)

    def _stop_snapping(self) -> None:
        self._snapped = self._surface = None
        if self._snapping is not None:
            self._snapping.remove()
            self._snapping = None

    @guarded
    def _toggle_weights(self, on: bool) -> None:
        if on:
            self._show_weights()
        else:
            self._hide_weights()

    def _show_weights(self) -> None:
        parameters = self.panel.parameters
        positions = landmark_points(self._node)[0].tobytes()
        wanted = (parameters.segmentation, parameters.segmentID, positions, parameters.landmarkRadiusMm)
        if self._weights is None or wanted != self._weighted:
            self._weighted = wanted
            self._weights = show_weights(*wanted[:2], self._node, parameters.landmarkRadiusMm or None)

    def _hide_weights(self) -> None:
        if self._weights is not None:
            self._weights.remove()
            self._weights = None
