"""Stand-in for qSlicerMarkupsPlaceWidget: the button that starts placing points."""

from __future__ import annotations

from typing import Any

import slicer
from PySide6 import QtGui, QtWidgets
from PySide6.QtCore import Property, Signal

from .mrml_widget import SceneObserver
from .stand_in import held, parent_of, row_layout
from .ui_loader import stand_in


@stand_in
class qSlicerMarkupsPlaceWidget(SceneObserver, QtWidgets.QWidget):
    mrmlSceneChanged = Signal(object)
    activeMarkupsFiducialPlaceModeChanged = Signal(bool)
    activeMarkupsPlaceModeChanged = Signal(bool)
    ShowPlaceMultipleMarkupsOption, HidePlaceMultipleMarkupsOption = 0, 1
    ForcePlaceSingleMarkup, ForcePlaceMultipleMarkups = 2, 3
    placeMultipleMarkups = held(int, "placeMultipleMarkups", 0)
    buttonsVisible = held(bool, "buttonsVisible", True)
    deleteAllControlPointsOptionVisible = held(bool, "deleteAllControlPointsOptionVisible", True)
    deleteMarkupsButtonVisible = held(bool, "deleteMarkupsButtonVisible", True)
    deleteAllMarkupsOptionVisible = held(bool, "deleteAllMarkupsOptionVisible", True)
    defaultNodeColor = held(QtGui.QColor, "defaultNodeColor", QtGui.QColor(255, 0, 0))

    def __init__(self, *arguments: Any) -> None:
        QtWidgets.QWidget.__init__(self, parent_of(arguments))
        self.start_observing()
        self._node, self._button = None, QtWidgets.QToolButton()
        self._button.setText("Place")
        self._button.setCheckable(True)
        row_layout(self).addWidget(self._button)
        self._button.toggled.connect(self._set_place_mode)

    def placeButton(self) -> QtWidgets.QToolButton:
        return self._button

    def currentNode(self) -> Any:
        return self._node

    def setCurrentNode(self, node: Any) -> None:
        self._node = node

    def setPlaceModeEnabled(self, on: bool) -> None:
        self._button.setChecked(bool(on))

    def _set_place_mode(self, on: bool) -> None:
        interaction = slicer.app.applicationLogic().GetInteractionNode()
        if on and self._node is not None:
            slicer.modules.markups.logic().SetActiveList(self._node)
            persistent = self.placeMultipleMarkups == self.ForcePlaceMultipleMarkups
            interaction.SetPlaceModePersistence(persistent)
            interaction.SetCurrentInteractionMode(interaction.Place)
        else:
            interaction.SetCurrentInteractionMode(interaction.ViewTransform)
        self.activeMarkupsFiducialPlaceModeChanged.emit(bool(on))
        self.activeMarkupsPlaceModeChanged.emit(bool(on))

    def _in_place_mode(self) -> bool:
        interaction = slicer.app.applicationLogic().GetInteractionNode()
        return interaction.GetCurrentInteractionMode() == interaction.Place

    placeModeEnabled = Property(bool, _in_place_mode, setPlaceModeEnabled)
