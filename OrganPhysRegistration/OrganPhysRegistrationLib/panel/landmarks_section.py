"""Section 1, third part: landmarks on the part of the organ that the endoscope sees."""

from __future__ import annotations

from typing import Any

import slicer
from slicer.i18n import tr as _

from ..inputs.landmark_input import landmark_messages, landmark_points, organ_surface, snap_to_surface
from ..inputs.segment_checks import is_empty
from .landmark_table import LandmarkTable
from .message_box import show_message
from .section import Section, guarded


class LandmarksSection(Section):
    """Point list with its place button and its names; points snap to the organ's surface."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        ui.landmarksPlaceWidget.placeMultipleMarkups = slicer.qSlicerMarkupsPlaceWidget.ForcePlaceSingleMarkup
        ui.addLandmarksButton.connect("clicked()", self.place_first)
        self._table = LandmarkTable(ui.landmarksTable)
        self._node: Any = None
        self._snapped: tuple[Any, ...] = ()
        self._snapping: Any = None
        self._surface: Any = None
        self._checked: tuple[Any, ...] = ()
        self._messages: list[str] = []

    def bind(self) -> None:
        self._stop_snapping()
        self._observe(None)

    def refresh(self) -> None:
        node, ui = self.panel.parameters.landmarks, self.ui
        self._observe(node)
        ui.landmarksPlaceWidget.setCurrentNode(node)
        ui.addLandmarksButton.visible = node is None
        ui.landmarksPlaceWidget.visible = node is not None
        self._snap()
        self._tell(self._table.show(node))

    def cleanup(self) -> None:
        self._stop_snapping()
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
        kinds = slicer.vtkMRMLMarkupsNode
        for event in (kinds.PointPositionDefinedEvent, kinds.PointRemovedEvent, kinds.PointModifiedEvent):
            if self._node is not None:
                self.removeObserver(self._node, event, self.panel.refresh_soon)
            if node is not None:
                self.addObserver(node, event, self.panel.refresh_soon)
        self._node = node

    @guarded
    def _snap(self) -> None:
        """Snap to the organ that is chosen now."""
        parameters = self.panel.parameters
        wanted = (self._node, parameters.segmentation, parameters.segmentID)
        if wanted == self._snapped:
            return
        self._stop_snapping()
        self._snapped = wanted
        if all(wanted) and not is_empty(*wanted[1:]):
            self._surface = organ_surface(parameters.segmentation, parameters.segmentID)
            self._snapping = snap_to_surface(self._node, self._surface)

    def _stop_snapping(self) -> None:
        snapping, self._snapping = self._snapping, None
        self._snapped, self._surface = (), None
        if snapping is not None:
            snapping.remove()

    @guarded
    def _tell(self, count: int) -> None:
        """What to do next, or what is wrong with the points."""
        if not count:
            hint = _("Place one or two points on the part of the organ that the endoscope sees.")
            show_message(self.ui.landmarksHintLabel, hint, "plain")
            return
        places = (self._surface, landmark_points(self._node)[0].tobytes(), count)
        if places != self._checked:
            self._checked = places
            self._messages = [] if self._surface is None else landmark_messages(self._node, self._surface)
        show_message(self.ui.landmarksHintLabel, self._messages, "warning")
