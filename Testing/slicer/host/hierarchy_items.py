"""Subject-hierarchy items for new data nodes: in Slicer the Qt plugins make them."""

from __future__ import annotations

from typing import Any

import slicer
import vtk


class HierarchyItems:
    def __init__(self, scene: Any) -> None:
        self._scene = scene
        scene.AddObserver(scene.NodeAddedEvent, self._on_added)
        scene.AddObserver(scene.EndImportEvent, lambda *_: self._add_all())
        self._add_all()

    def _add_all(self) -> None:
        for index in range(self._scene.GetNumberOfNodes()):
            self._add(self._scene.GetNthNode(index))

    @vtk.calldata_type(vtk.VTK_OBJECT)
    def _on_added(self, _scene: Any, _event: str, node: Any) -> None:
        if not self._scene.IsImporting():
            self._add(node)

    def _add(self, node: Any) -> None:
        if node is None or not any(node.IsA(c) for c in ("vtkMRMLDisplayableNode", "vtkMRMLStorableNode")):
            return
        if node.GetHideFromEditors() or node.IsA("vtkMRMLColorNode") or node.IsA("vtkMRMLAbstractViewNode"):
            return
        hierarchy = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(self._scene)
        if hierarchy is not None and not hierarchy.GetItemByDataNode(node):
            hierarchy.CreateItem(hierarchy.GetSceneItemID(), node)
