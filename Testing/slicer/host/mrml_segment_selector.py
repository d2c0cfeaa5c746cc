"""Stand-in for qMRMLSegmentSelectorWidget: a segmentation and one of its segments."""

from __future__ import annotations

from typing import Any

import vtk
from PySide6 import QtWidgets
from PySide6.QtCore import Property, Signal

from .mrml_node_combo import qMRMLNodeComboBox
from .mrml_widget import SceneObserver
from .stand_in import held, parent_of, row_layout
from .ui_loader import stand_in


@stand_in
class qMRMLSegmentSelectorWidget(SceneObserver, QtWidgets.QWidget):
    mrmlSceneChanged = Signal(object)
    currentNodeChanged = Signal(object)
    currentSegmentChanged = Signal(str)
    noneEnabled = held(bool, "noneEnabled", False)
    selectNodeMessageTextVisible = held(bool, "selectNodeMessageTextVisible", True)
    horizontalLayout = held(bool, "horizontalLayout", False)

    def __init__(self, *arguments: Any) -> None:
        QtWidgets.QWidget.__init__(self, parent_of(arguments))
        self.start_observing()
        self._segment, self._listed, self._observed = "", [], None
        self._nodes, self._segments = qMRMLNodeComboBox(), QtWidgets.QComboBox()
        self._nodes.nodeTypes = ["vtkMRMLSegmentationNode"]
        self._nodes.noneEnabled, self._nodes.addEnabled = True, False
        self._segments.setMinimumWidth(80)
        layout = row_layout(self, vertical=True)
        layout.addWidget(self._nodes)
        layout.addWidget(self._segments)
        self._nodes.currentNodeChanged.connect(self._on_node)
        self._segments.activated.connect(lambda index: self.setCurrentSegmentID(self._listed[index]))

    segmentationNodeSelectorVisible = Property(
        bool, lambda self: not self._nodes.isHidden(), lambda self, shown: self._nodes.setVisible(shown)
    )

    def setMRMLScene(self, scene: Any) -> None:
        SceneObserver.setMRMLScene(self, scene)
        self._nodes.setMRMLScene(scene)

    def _on_node(self, node: Any) -> None:
        if self._observed is not None:
            self._observed[0].RemoveObserver(self._observed[1])
            self._observed = None
        if node is not None:
            self._observed = (node, node.AddObserver(vtk.vtkCommand.AnyEvent, lambda *_: self._fill()))
        self._fill()
        self.currentNodeChanged.emit(node)

    def _fill(self) -> None:
        node = self.currentNode()
        ids = list(node.GetSegmentation().GetSegmentIDs()) if node is not None else []
        if ids == self._listed:
            return
        self._listed = ids
        self._segments.blockSignals(True)
        self._segments.clear()
        self._segments.addItems([node.GetSegmentation().GetSegment(i).GetName() for i in ids])
        self._segments.blockSignals(False)
        first = ids[0] if ids and not self.noneEnabled else ""
        self.setCurrentSegmentID(self._segment if self._segment in ids else first)

    def currentNode(self) -> Any:
        return self._nodes.currentNode()

    def currentNodeID(self) -> str:
        return self._nodes.currentNodeID

    def setCurrentNode(self, node: Any) -> None:
        self._nodes.setCurrentNode(node)

    def setCurrentNodeID(self, node_id: str) -> None:
        self._nodes.setCurrentNodeID(node_id)

    def currentSegmentID(self) -> str:
        return self._segment

    def setCurrentSegmentID(self, segment_id: str) -> None:
        segment_id = segment_id or ""
        if segment_id and segment_id not in self._listed:
            return
        self._segments.setCurrentIndex(self._listed.index(segment_id) if segment_id else -1)
        if segment_id != self._segment:
            self._segment = segment_id
            self.currentSegmentChanged.emit(segment_id)
