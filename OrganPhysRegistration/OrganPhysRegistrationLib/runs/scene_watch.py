"""Tells a run when its nodes leave the scene or the scene is closed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import slicer
import vtk


class SceneWatch:
    """Observes the scene until ``remove``.

    ``nodes``: what a user calls it -> node, None ones are left out; ``on_removed``: called with that name after the
    node has left the scene; ``on_closing``: called before the scene is emptied.
    """

    def __init__(
        self,
        nodes: Mapping[str, Any],
        *,
        on_removed: Callable[[str], None],
        on_closing: Callable[[], None],
    ) -> None:
        names = {node.GetID(): name for name, node in nodes.items() if node is not None}
        scene = slicer.mrmlScene

        @vtk.calldata_type(vtk.VTK_OBJECT)
        def removed(caller: Any, event: str, node: Any) -> None:
            if node.GetID() in names and not scene.IsClosing():
                on_removed(names[node.GetID()])

        def closing(caller: Any, event: str) -> None:
            on_closing()

        self._tags = [
            scene.AddObserver(slicer.vtkMRMLScene.NodeRemovedEvent, removed),
            scene.AddObserver(slicer.vtkMRMLScene.StartCloseEvent, closing),
        ]

    def remove(self) -> None:
        """Observe no longer."""
        for tag in self._tags:
            slicer.mrmlScene.RemoveObserver(tag)
        self._tags = []
