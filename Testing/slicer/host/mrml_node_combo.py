"""Stand-in for qMRMLNodeComboBox on a real scene."""

from __future__ import annotations

from typing import Any

from PySide6 import QtWidgets
from PySide6.QtCore import Property, Signal

from .mrml_widget import SceneObserver
from .stand_in import held, parent_of, row_layout
from .ui_loader import stand_in


def _again(self: Any) -> None:
    self.scene_changed()


@stand_in
class qMRMLNodeComboBox(SceneObserver, QtWidgets.QWidget):
    mrmlSceneChanged = Signal(object)
    currentNodeChanged = Signal(object)
    currentNodeIDChanged = Signal(str)
    nodeAdded = Signal(object)
    nodeAddedByUser = Signal(object)
    nodeActivated = Signal(object)
    noneEnabled = held(bool, "noneEnabled", False, changed=_again)
    noneDisplay = held(str, "noneDisplay", "None", changed=_again)
    addEnabled = held(bool, "addEnabled", True, changed=_again)
    removeEnabled = held(bool, "removeEnabled", True)
    editEnabled = held(bool, "editEnabled", False)
    renameEnabled = held(bool, "renameEnabled", False)
    baseName = held(str, "baseName", "")
    showHidden = held(bool, "showHidden", False, changed=_again)
    showChildNodeTypes = held(bool, "showChildNodeTypes", True, changed=_again)
    selectNodeUponCreation = held(bool, "selectNodeUponCreation", True)
    interactionNodeSingletonTag = held(str, "interactionNodeSingletonTag", "")

    def __init__(self, *arguments: Any) -> None:
        QtWidgets.QWidget.__init__(self, parent_of(arguments))
        self.start_observing()
        self._types, self._attributes = [], []
        self._current, self._wanted, self._ids, self._adding = None, None, [], False
        self._combo = QtWidgets.QComboBox()
        policy = QtWidgets.QSizePolicy
        self._combo.setSizePolicy(policy.Ignored, policy.Fixed)
        self._combo.setMinimumWidth(80)
        row_layout(self).addWidget(self._combo)
        self._combo.activated.connect(self._on_activated)

    def setNodeTypes(self, types: list[str]) -> None:
        self._types = list(types)
        self.scene_changed()

    nodeTypes = Property("QStringList", lambda self: self._types, setNodeTypes)

    def addAttribute(self, node_type: str, name: str, value: Any = None) -> None:
        self._attributes.append((node_type, name, None if value is None else str(value)))
        self.scene_changed()

    def nodes(self) -> list[Any]:
        if self._scene is None:
            return []
        listed = (self._scene.GetNthNode(i) for i in range(self._scene.GetNumberOfNodes()))
        return [node for node in listed if self._lists(node)]

    def nodeCount(self) -> int:
        return len(self.nodes())

    def _lists(self, node: Any) -> bool:
        fits = any(node.IsA(t) if self.showChildNodeTypes else node.GetClassName() == t for t in self._types)
        if not fits or (node.GetHideFromEditors() and not self.showHidden):
            return False
        for node_type, name, value in self._attributes:
            held_value = node.GetAttribute(name)
            if node.IsA(node_type) and (held_value is None or value not in (None, held_value)):
                return False
        return True

    def scene_changed(self) -> None:
        if self.__dict__.get("_combo") is None or self._adding:
            return
        nodes = self.nodes()
        self._ids = ([None] if self.noneEnabled else []) + [node.GetID() for node in nodes]
        self._combo.blockSignals(True)
        self._combo.clear()
        none = [self.noneDisplay] if self.noneEnabled else []
        self._combo.addItems(none + [node.GetName() or node.GetID() for node in nodes])
        if self.addEnabled and self._types:
            self._combo.addItem("Create new " + self._types[0].removeprefix("vtkMRML").removesuffix("Node"))
        self._combo.blockSignals(False)
        current = self._wanted if self._wanted in self._ids and self._wanted else self._current
        if current not in self._ids:
            current = None if self.noneEnabled or not nodes else nodes[0].GetID()
        self._select(current)

    def _select(self, node_id: str | None) -> None:
        if node_id is not None and node_id == self._wanted:
            self._wanted = None
        self._combo.blockSignals(True)
        self._combo.setCurrentIndex(self._ids.index(node_id) if node_id in self._ids else -1)
        self._combo.blockSignals(False)
        if node_id != self._current:
            self._current = node_id
            self.currentNodeChanged.emit(self.currentNode())
            self.currentNodeIDChanged.emit(node_id or "")

    def _on_activated(self, index: int) -> None:
        if index < len(self._ids):
            self._select(self._ids[index])
            self.nodeActivated.emit(self.currentNode())
        else:
            self.addNode()

    def currentNode(self) -> Any:
        return self._scene.GetNodeByID(self._current) if self._scene is not None and self._current else None

    def setCurrentNode(self, node: Any) -> None:
        self.setCurrentNodeID(node.GetID() if node is not None else None)

    def setCurrentNodeID(self, node_id: str | None) -> None:
        self._wanted = None
        if node_id and node_id not in self._ids:  # not listed (yet): taken when the scene's update arrives
            self._wanted = node_id
            self.scene_changed()
        else:
            self._select(node_id or None)

    currentNodeID = Property(str, lambda self: self._current or "", setCurrentNodeID)

    def addNode(self, node_type: str | None = None) -> Any:
        kind, self._adding = node_type or self._types[0], True
        name = self._scene.GenerateUniqueName(self.baseName) if self.baseName else ""
        node = self._scene.AddNewNodeByClass(kind, name) if name else self._scene.AddNewNodeByClass(kind)
        for matching, attribute, value in self._attributes:
            if node.IsA(matching):
                node.SetAttribute(attribute, value or "")
        if hasattr(node, "CreateDefaultDisplayNodes"):
            node.CreateDefaultDisplayNodes()
        self._adding = False
        self.scene_changed()
        if self.selectNodeUponCreation:
            self.setCurrentNode(node)
        self.nodeAdded.emit(node)
        self.nodeAddedByUser.emit(node)
        return node
