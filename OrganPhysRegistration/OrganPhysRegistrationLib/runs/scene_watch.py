"""Tells a run when its nodes leave the scene, its segment leaves the segmentation, or the scene is closed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import slicer
import vtk


class SceneWatch:
    """Observes the scene until ``remove``.

    ``nodes``: what a user calls it -> node, None ones are left out; ``on_removed``: called with that name after the
    node has left the scene, or with "segment" once the segmentation has lost ``segment_id``; ``on_closing``: called
    before the scene is emptied.
    """

    def __init__(
        self,
        nodes: Mapping[str, Any],
        *,
        segmentation: Any,
        segment_id: str,
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

        def segment_removed(caller: Any, event: str) -> None:
            if segmentation.GetSegmentation().GetSegment(segment_id) is None and not scene.IsClosing():
                on_removed("segment")

        self._tags = [
            (scene, scene.AddObserver(slicer.vtkMRMLScene.NodeRemovedEvent, removed)),
            (scene, scene.AddObserver(slicer.vtkMRMLScene.StartCloseEvent, closing)),
            (segmentation, segmentation.AddObserver(slicer.vtkSegmentation.SegmentRemoved, segment_removed)),
        ]

    def remove(self) -> None:
        """Observe no longer."""
        for observed, tag in self._tags:
            observed.RemoveObserver(tag)
        self._tags = []
