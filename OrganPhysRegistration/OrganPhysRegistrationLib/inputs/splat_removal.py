"""A splat that is deleted takes its "scene to world" transform along, which was made for it alone."""

from __future__ import annotations

from typing import Any

import slicer
import vtk

from .matrices import ROLE
from .splat_node import SPLAT
from .splat_scale import SCENE_TO_WORLD


class SplatRemoval:
    """Observes the scene until ``remove``."""

    def __init__(self, scene: Any = None) -> None:
        self._scene = scene or slicer.mrmlScene

        @vtk.calldata_type(vtk.VTK_OBJECT)
        def removed(caller: Any, event: str, node: Any) -> None:
            if not self._scene.IsClosing() and node.IsA("vtkMRMLModelNode") and node.GetAttribute(SPLAT) == "1":
                self._remove_unused()

        self._tag = self._scene.AddObserver(slicer.vtkMRMLScene.NodeRemovedEvent, removed)

    def remove(self) -> None:
        """Observe no longer."""
        self._scene.RemoveObserver(self._tag)

    def _remove_unused(self) -> None:
        """Remove the "scene to world" transforms under which nothing stands any more."""
        nodes = list(self._scene.GetNodes())
        in_use = {node.GetTransformNodeID() for node in nodes if node.IsA("vtkMRMLTransformableNode")}
        for node in nodes:
            if node.GetAttribute(ROLE) == SCENE_TO_WORLD and node.GetID() not in in_use:
                self._scene.RemoveNode(node)
