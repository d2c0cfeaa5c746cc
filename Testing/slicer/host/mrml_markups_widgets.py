"""Stand-ins for Slicer's markups widgets: the place button and the simple list of points."""

from __future__ import annotations

from typing import Any

import slicer
import vtk
from PySide6 import QtGui, QtWidgets
from PySide6.QtCore import Property, Signal

from .mrml_node_combo import qMRMLNodeComboBox
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


@stand_in
class qSlicerSimpleMarkupsWidget(SceneObserver, QtWidgets.QWidget):
    mrmlSceneChanged = Signal(object)
    markupsNodeChanged = Signal()
    updateFinished = Signal()
    enterPlaceModeOnNodeChange = held(bool, "enterPlaceModeOnNodeChange", True)
    jumpToSliceEnabled = held(bool, "jumpToSliceEnabled", False)
    optionsVisible = held(bool, "optionsVisible", True)
    defaultNodeColor = held(QtGui.QColor, "defaultNodeColor", QtGui.QColor(255, 0, 0))

    def __init__(self, *arguments: Any) -> None:
        QtWidgets.QWidget.__init__(self, parent_of(arguments))
        self.start_observing()
        self._observed, self._nodes, self._place = None, qMRMLNodeComboBox(), qSlicerMarkupsPlaceWidget()
        self._nodes.nodeTypes, self._nodes.noneEnabled = ["vtkMRMLMarkupsFiducialNode"], True
        self._table = QtWidgets.QTableWidget(0, 4)
        self._table.setHorizontalHeaderLabels(["Name", "R", "A", "S"])
        row = QtWidgets.QHBoxLayout()
        row.addWidget(self._nodes, 1)
        row.addWidget(self._place)
        layout = row_layout(self, vertical=True)
        layout.addLayout(row)
        layout.addWidget(self._table)
        self._nodes.currentNodeChanged.connect(self._on_node)

    def setMRMLScene(self, scene: Any) -> None:
        SceneObserver.setMRMLScene(self, scene)
        self._nodes.setMRMLScene(scene)
        self._place.setMRMLScene(scene)

    def _on_node(self, node: Any) -> None:
        if self._observed is not None:
            self._observed[0].RemoveObserver(self._observed[1])
            self._observed = None
        if node is not None:
            self._observed = (node, node.AddObserver(vtk.vtkCommand.ModifiedEvent, lambda *_: self._fill()))
        self._place.setCurrentNode(node)
        self._fill()
        self.markupsNodeChanged.emit()

    def _fill(self) -> None:
        node = self.currentNode()
        count = node.GetNumberOfControlPoints() if node is not None else 0
        self._table.setRowCount(count)
        for row in range(count):
            position = node.GetNthControlPointPositionWorld(row)
            cells = [node.GetNthControlPointLabel(row), *(f"{value:.1f}" for value in position)]
            for column, text in enumerate(cells):
                self._table.setItem(row, column, QtWidgets.QTableWidgetItem(text))
        self.updateFinished.emit()

    def currentNode(self) -> Any:
        return self._nodes.currentNode()

    def setCurrentNode(self, node: Any) -> None:
        self._nodes.setCurrentNode(node)

    def markupsPlaceWidget(self) -> qSlicerMarkupsPlaceWidget:
        return self._place

    def markupsSelectorComboBox(self) -> qMRMLNodeComboBox:
        return self._nodes

    def tableWidget(self) -> QtWidgets.QTableWidget:
        return self._table
