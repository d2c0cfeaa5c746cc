"""Ends a simulation when the scene closes or a node that it stands on leaves the scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import slicer
import vtk

from .roles import ROLE

NEEDED = ("frame", "surface", "tool", "instrument", "trocar")


class SceneGuard:
    """Observes the scene until ``remove``. ``on_left(name)``: one of ``nodes`` or of the simulation's own is gone."""

    def __init__(self, nodes: Sequence[Any], *, on_left: Callable[[str], None], on_closing: Callable[[], None]) -> None:
        names = {node.GetID(): node.GetName() for node in nodes if node is not None}
        scene = slicer.mrmlScene

        @vtk.calldata_type(vtk.VTK_OBJECT)
        def removed(caller: Any, event: str, node: Any) -> None:
            if self._tags and not scene.IsClosing() and (node.GetID() in names or node.GetAttribute(ROLE) in NEEDED):
                on_left(node.GetName())

        def closing(caller: Any, event: str) -> None:
            on_closing()

        self._tags = [
            scene.AddObserver(slicer.vtkMRMLScene.NodeRemovedEvent, removed),
            scene.AddObserver(slicer.vtkMRMLScene.StartCloseEvent, closing),
        ]

    def remove(self) -> None:
        """Observe no longer."""
        tags, self._tags = self._tags, []
        for tag in tags:
            slicer.mrmlScene.RemoveObserver(tag)
