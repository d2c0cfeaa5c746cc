"""The surface as it moves during a run: a model that is never saved and leaves no trace."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk

from organphys.ground.checks import InputError

from .case_record import SURFACES, CaseNodes
from .geometry import cells, vtk_points
from .node_factory import followers, remove

COLOUR = (0.35, 0.75, 1.0)


class LiveOverlay:
    """Shows surfaces in raw scene units under the splat's own transform; the case's results are hidden meanwhile.

    faces (Nf, 3). ``remove()`` takes the model away and shows again what was shown; it may be called twice, and also
    when the scene was closed meanwhile.
    """

    def __init__(self, splat: Any, faces: Any, case: CaseNodes | None = None) -> None:
        self._scene, self._mesh = splat.GetScene(), vtk.vtkPolyData()
        self._mesh.SetPolys(cells(faces))
        self._count = int(np.max(faces)) + 1
        self._case, self._hidden = case, _shown(case) if case is not None else []
        for display in self._hidden:
            display.SetVisibility(False)
        self._node = self._scene.CreateNodeByClass("vtkMRMLModelNode")
        self._node.UnRegister(None)
        self._node.SetName("OrganPhys live overlay")
        self._node.SetSaveWithScene(False)
        self._node.SetHideFromEditors(True)
        self._scene.AddNode(self._node)
        self._node.SetAndObserveTransformNodeID(splat.GetTransformNodeID())

    def update(self, vertices: Any) -> None:
        """Show vertices (Nv, 3) in scene units. A few milliseconds; nothing happens once the scene was closed."""
        if not self._present():
            return
        if len(vertices) < self._count:
            raise InputError(f"live overlay: expected at least {self._count} vertices, got {len(vertices)}")
        self._mesh.SetPoints(vtk_points(vertices))
        if self._node.GetDisplayNode() is None:
            self._node.SetAndObserveMesh(self._mesh)
            self._show()
        else:
            self._mesh.Modified()

    def remove(self) -> None:
        """Take the model out of the scene and show the case's surfaces again."""
        if self._present():
            remove(self._scene, self._node)
        if self._case is not None and not _shown(self._case):  # else a new result is shown already
            for display in self._hidden:
                if self._scene.IsNodePresent(display):
                    display.SetVisibility(True)
        self._hidden = []

    def _present(self) -> bool:
        return bool(self._scene.IsNodePresent(self._node))

    def _show(self) -> None:
        display = self._scene.CreateNodeByClass("vtkMRMLModelDisplayNode")
        display.UnRegister(None)
        display.SetSaveWithScene(False)
        display.SetColor(*COLOUR)
        display.SetOpacity(0.6)
        display.SetInterpolation(slicer.vtkMRMLDisplayNode.FlatInterpolation)
        self._scene.AddNode(display)
        self._node.SetAndObserveDisplayNodeID(display.GetID())


def _shown(case: CaseNodes) -> list[Any]:
    """Display nodes of the case's surfaces that are visible, colour legends among them."""
    displays = [one for node in map(case.get, SURFACES) if node is not None for one in followers(node)]
    return [one for one in displays if one.IsA("vtkMRMLDisplayNode") and one.GetVisibility()]
