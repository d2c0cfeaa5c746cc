"""The closed surface of a segment in the world, for snapping landmarks and for colouring."""

from __future__ import annotations

from typing import Any

import vtk

from organphys.ground.checks import InputError

from .segment_checks import checked_segment
from .segment_input import private_copy

CLOSED_SURFACE = "Closed surface"

_last: dict[str, Any] = {}  # the last surface made, which takes a second for a liver


def organ_surface(segmentation_node: Any, segment_id: str | None) -> vtk.vtkPolyData:
    """Triangles of one segment, RAS mm, parent transforms included; the segmentation is not changed.

    The surface is the one shown in 3D where there is one, else it is made from a copy of the segment.
    """
    segment = checked_segment(segmentation_node, segment_id)
    surface = segment.GetRepresentation(CLOSED_SURFACE) or _made(segmentation_node, segment_id)
    if surface is None or surface.GetNumberOfPolys() == 0:
        raise InputError(f"segment {segment.GetName()}: it has no surface; paint the organ or choose another segment")
    in_world = vtk.vtkPolyData()
    parent = segmentation_node.GetParentTransformNode()
    if parent is None:
        in_world.DeepCopy(surface)
        return in_world
    to_world = vtk.vtkGeneralTransform()
    parent.GetTransformToWorld(to_world)
    mover = vtk.vtkTransformPolyDataFilter()
    mover.SetTransform(to_world)
    mover.SetInputData(surface)
    mover.Update()
    in_world.DeepCopy(mover.GetOutput())
    return in_world


def _made(segmentation_node: Any, segment_id: str) -> vtk.vtkPolyData | None:
    """The surface made from a copy of the segment, in the node's frame; None where nothing can be made."""
    content = segmentation_node.GetSegmentation()
    source = content.GetSegment(segment_id).GetRepresentation(content.GetSourceRepresentationName())
    key = (segmentation_node.GetID(), segment_id, source, source.GetMTime() if source is not None else 0)
    if _last.get("key") != key:
        copy = private_copy(segmentation_node, segment_id)
        copy.CreateRepresentation(CLOSED_SURFACE)
        _last.update(key=key, surface=copy.GetSegment(segment_id).GetRepresentation(CLOSED_SURFACE))
    return _last["surface"]
