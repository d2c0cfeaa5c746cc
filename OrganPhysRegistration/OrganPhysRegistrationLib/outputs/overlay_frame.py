"""Where splat and results stand: beside the CT as the endoscope saw them, or brought together into the CT."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk

from organphys.ground.checks import InputError, one_of

from ..inputs.matrices import array_of, matrix_of
from ..inputs.splat_scale import scene_to_world
from .case_record import ROLE, CaseNodes
from .geometry import Array
from .node_factory import ensure

WHERE = ("endoscope", "CT")
OVERLAY_IN = "OrganPhys.OverlayIn"


def set_overlay(case: CaseNodes, where: str) -> None:
    """Show splat and results of the case in the "endoscope" frame or moved into the "CT" by the inverse similarity."""
    one_of(where, "overlay", WHERE)
    frame = case.node("overlay_frame")
    frame.SetAttribute(OVERLAY_IN, where)
    T_parent_overlay = np.eye(4)
    if where == "CT":
        T_world_parent = world_from(frame.GetParentTransformNode())
        T_parent_overlay = np.linalg.inv(T_world_parent) @ np.linalg.inv(T_overlay_ct(case))
    frame.SetMatrixTransformToParent(matrix_of(T_parent_overlay))


def overlay_in(case: CaseNodes) -> str:
    """Where splat and results of the case are shown now."""
    return case.node("overlay_frame").GetAttribute(OVERLAY_IN) or WHERE[0]


def T_overlay_ct(case: CaseNodes, stage: str | None = None) -> Array:
    """Similarity (4, 4) of a stage (None: the last one) from CT RAS mm to the overlay frame, mm."""
    record = case.record
    return np.array(record["T_overlay_scene"]) @ np.array(record["similarities"][stage or record["stage"]])


def put_under_overlay_frame(case: CaseNodes, splat: Any) -> Any:
    """The frame node above the splat's scene-to-world node, made at first use; parents that it had stay above."""
    mover = scene_to_world(splat)
    frame = frame_above(splat)
    if frame is None:
        frame = ensure(case, "overlay_frame")
        frame.SetAndObserveTransformNodeID(mover.GetTransformNodeID())
        mover.SetAndObserveTransformNodeID(frame.GetID())
    return frame


def T_overlay_scene(splat: Any, frame: Any) -> Array:
    """Matrix (4, 4) from raw scene units to the overlay frame in mm: all transforms between the two."""
    between = vtk.vtkMatrix4x4()
    if not type(frame).GetMatrixTransformBetweenNodes(splat.GetParentTransformNode(), frame, between):
        raise InputError(f"{splat.GetName()}: stands under a non-linear transform; take it out or harden it")
    return array_of(between)


def world_from(transform: Any) -> Array:
    """Matrix (4, 4) from under a transform node (None: the world) to the world."""
    matrix = vtk.vtkMatrix4x4()
    if transform is not None and not transform.GetMatrixTransformToWorld(matrix):
        raise InputError(f"{transform.GetName()}: is not linear; the splat can only stand under linear transforms")
    return array_of(matrix)


def frame_above(node: Any) -> Any:
    """The overlay frame among the parents of a node, None if there is none."""
    node = node.GetParentTransformNode()
    while node is not None and node.GetAttribute(ROLE) != "overlay_frame":
        node = node.GetParentTransformNode()
    return node
