"""Section 1, after the landmarks: the same points on the splat."""

from __future__ import annotations

from typing import Any

import slicer
from slicer.i18n import tr as _

from ..inputs.landmark_input import name_clearly
from ..inputs.splat_landmarks import keep_on_splat
from ..inputs.splat_node import is_splat
from .section import Section, guarded


class SplatLandmarksSection(Section):
    """Point list with its place button; its points go along with the splat. What is wrong is told at Register."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self.ui.splatLandmarksPlaceWidget.placeMultipleMarkups = slicer.qSlicerMarkupsPlaceWidget.ForcePlaceSingleMarkup
        self.ui.addSplatLandmarksButton.connect("clicked()", self.place_first)
        self._node: Any = None

    def bind(self) -> None:
        self._observe(None)

    def refresh(self) -> None:
        node, ui = self.panel.parameters.splatLandmarks, self.ui
        self._observe(node)
        ui.splatLandmarksPlaceWidget.setCurrentNode(node)
        ui.addSplatLandmarksButton.visible = node is None
        ui.splatLandmarksPlaceWidget.visible = node is not None
        self._keep()

    @guarded
    def place_first(self) -> None:
        """Make a point list and start placing."""
        name = slicer.mrmlScene.GenerateUniqueName(_("Splat landmarks"))
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", name)
        node.CreateDefaultDisplayNodes()
        self.panel.parameters.splatLandmarks = node
        self.panel.refresh()
        self.ui.splatLandmarksPlaceWidget.setPlaceModeEnabled(True)

    @guarded
    def _keep(self) -> None:
        """The organ's own list, chosen here by mistake, is left where it is."""
        parameters = self.panel.parameters
        if self._node is not None and self._node is not parameters.landmarks and is_splat(parameters.splat):
            name_clearly(self._node)
            keep_on_splat(self._node, parameters.splat)

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
