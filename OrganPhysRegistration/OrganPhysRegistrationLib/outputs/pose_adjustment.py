"""Moving the organ by hand: handles for shift, turn and even scaling on the shown surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer

from ..inputs.matrices import matrix_of, to_parent
from .case_record import CaseNodes
from .geometry import Array, points_of, similarity_of
from .node_factory import remove
from .overlay_frame import T_overlay_ct
from .stage_switch import shown_stage


class PoseAdjustment:
    """A transform with handles between the shown surface and its frame, from ``start()`` to ``stop()``.

    Whatever the handles do is kept a similarity: a pull on one scaling handle scales the organ evenly.
    """

    def __init__(self, case: CaseNodes) -> None:
        self._case, self._node, self._tag, self._surface, self._stage = case, None, None, None, ""

    @property
    def active(self) -> bool:
        """Whether handles are shown."""
        return self._node is not None and bool(self._case.scene.IsNodePresent(self._node))

    def start(self, stage: str | None = None) -> Any:
        """Show the handles on a stage's surface (None: the one that is shown); the interaction transform node."""
        self.stop()
        self._stage = stage or shown_stage(self._case)
        self._surface = self._case.node(f"surface_{self._stage}")
        scene = self._case.scene
        node = scene.CreateNodeByClass("vtkMRMLLinearTransformNode")
        node.UnRegister(None)
        node.SetName("OrganPhys pose adjustment")
        node.SetSaveWithScene(False)
        scene.AddNode(node)
        self._centre = points_of(self._surface.GetPolyData()).mean(0)
        node.SetCenterOfTransformation(*map(float, self._centre))
        node.SetAndObserveTransformNodeID(self._surface.GetTransformNodeID())
        self._surface.SetAndObserveTransformNodeID(node.GetID())
        self._node = node
        node.CreateDefaultDisplayNodes()
        _show_handles(node.GetDisplayNode())
        self._tag = node.AddObserver(slicer.vtkMRMLTransformableNode.TransformModifiedEvent, self._keep_similarity)
        return node

    def T_scene_ct(self) -> Array:
        """The adjusted similarity (4, 4), CT RAS mm to raw scene units: the start of the next stage."""
        T_overlay_scene = np.array(self._case.record["T_overlay_scene"])
        moved = to_parent(self._node) if self.active else np.eye(4)
        if np.array_equal(moved, np.eye(4)):
            return np.array(self._case.record["similarities"][self._stage or shown_stage(self._case)])
        adjusted = similarity_of(moved, self._centre) @ T_overlay_ct(self._case, self._stage)
        return np.asarray(np.linalg.inv(T_overlay_scene) @ adjusted)

    def stop(self) -> None:
        """Take the handles away; the surface stands where it stood before."""
        if self._node is None:
            return
        self._node.RemoveObserver(self._tag)
        if self.active:
            if self._case.scene.IsNodePresent(self._surface):
                self._surface.SetAndObserveTransformNodeID(self._node.GetTransformNodeID())
            remove(self._case.scene, self._node)
        self._node, self._stage = None, ""

    def _keep_similarity(self, caller: Any, event: Any) -> None:
        now = to_parent(caller)
        kept = similarity_of(now, self._centre)
        if not np.allclose(now, kept, rtol=0, atol=1e-9 * max(1.0, float(np.abs(kept).max()))):
            caller.SetMatrixTransformToParent(matrix_of(kept))


def _show_handles(display: Any) -> None:
    display.SetSaveWithScene(False)
    display.SetEditorVisibility(True)
    for part in ("Translation", "Rotation", "Scaling"):
        getattr(display, f"SetEditor{part}Enabled")(True)
    display.SetVisibility(True)
    display.InvokeEvent(slicer.vtkMRMLTransformDisplayNode.TransformUpdateEditorBoundsEvent)
