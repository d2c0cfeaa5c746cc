"""Subject-hierarchy items of data nodes: in Slicer the Qt plugins make them, and remove them with the node."""

from __future__ import annotations

from typing import Any

import slicer
import vtk


class HierarchyItems:
    def __init__(self, scene: Any) -> None:
        self._scene = scene
        scene.AddObserver(scene.NodeAddedEvent, self._on_added)
        scene.AddObserver(scene.NodeAboutToBeRemovedEvent, self._on_about_to_be_removed)
        scene.AddObserver(scene.EndImportEvent, lambda *_: self._add_all())
        self._add_all()

    def _add_all(self) -> None:
        for index in range(self._scene.GetNumberOfNodes()):
            self._add(self._scene.GetNthNode(index))

    @vtk.calldata_type(vtk.VTK_OBJECT)
    def _on_added(self, _scene: Any, _event: str, node: Any) -> None:
        if not self._scene.IsImporting():
            self._add(node)

    @vtk.calldata_type(vtk.VTK_OBJECT)
    def _on_about_to_be_removed(self, _scene: Any, _event: str, node: Any) -> None:
        if node is None or self._scene.IsClosing() or node.IsA("vtkMRMLSubjectHierarchyNode"):
            return
        hierarchy = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(self._scene)
        item = hierarchy.GetItemByDataNode(node) if hierarchy is not None else 0
        if item:
            hierarchy.RemoveItem(item, False, False)

    def _add(self, node: Any) -> None:
        if node is None or not any(node.IsA(c) for c in ("vtkMRMLDisplayableNode", "vtkMRMLStorableNode")):
            return
        if node.GetHideFromEditors() or node.IsA("vtkMRMLColorNode") or node.IsA("vtkMRMLAbstractViewNode"):
            return
        hierarchy = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(self._scene)
        if hierarchy is not None and not hierarchy.GetItemByDataNode(node):
            hierarchy.CreateItem(hierarchy.GetSceneItemID(), node)
