"""Landmarks clicked on the organ: read in the world, kept on its surface; what is wrong with them in plain words."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk

from organphys.ground.checks import Array, InputError

from .landmark_list import USED, landmark_points, placed, position_of
from .landmark_weights import show_weights
from .organ_surface import organ_surface

__all__ = ["landmark_messages", "landmark_points", "organ_surface", "show_weights", "snap_to_surface"]

FAR_MM = 30.0  # farther from the surface a point is taken for misplaced, not for imprecise
SAME_MM = 1.0
ON_SURFACE_MM = 1e-3
SLICER_FORMAT = "%N-%d"
FORMAT = "Landmark %d"

_last: dict[str, Any] = {}  # the last locator: building it takes longer than all its answers


def landmark_messages(node: Any, surface: vtk.vtkPolyData) -> list[str]:
    """What should be corrected, one sentence each; ``surface``: the organ's in the world, mm (see organ_surface)."""
    positions, names = landmark_points(node)
    messages, locator = [], _locator(surface)
    for name, point in zip(names, positions, strict=True):
        far = float(np.linalg.norm(_nearest(locator, point) - point))
        if far > FAR_MM:
            messages.append(f"{name} lies {far:.0f} mm from the organ's surface: move it onto the organ, or remove it.")
    if len(positions) == USED and np.linalg.norm(positions[1] - positions[0]) < SAME_MM:
        messages.append(f"{names[0]} and {names[1]} are at the same place: move one of them to another part.")
    count = len(placed(node))
    if count > USED:
        messages.append(f"Only the first {USED} of {count} landmarks are used: remove the others.")
    return messages


def snap_to_surface(node: Any, surface: vtk.vtkPolyData) -> SurfaceSnapping:
    """Keep the points of a markups list on ``surface`` (world, mm) until the returned object's ``remove()``.

    Points more than 30 mm away stay where they are (see landmark_messages). Names that Slicer made up become
    "Landmark 1", "Landmark 2".
    """
    if node is None or not node.IsA("vtkMRMLMarkupsNode"):
        raise InputError("landmarks: no point list chosen; choose one or press the place button")
    return SurfaceSnapping(node, surface)


class SurfaceSnapping:
    """Observes a markups list; made by snap_to_surface."""

    def __init__(self, node: Any, surface: vtk.vtkPolyData) -> None:
        self._node, self._locator, self._busy = node, _locator(surface), False
        name_clearly(node)
        events = (slicer.vtkMRMLMarkupsNode.PointPositionDefinedEvent, slicer.vtkMRMLMarkupsNode.PointModifiedEvent)
        self._tags = [node.AddObserver(event, self._changed) for event in events]
        self._changed()

    def remove(self) -> None:
        """Stop; the points stay where they are."""
        for tag in self._tags:
            self._node.RemoveObserver(tag)
        self._tags = []

    def _changed(self, *_: Any) -> None:
        if self._busy:  # its own moves are told too
            return
        self._busy = True
        try:
            for index in placed(self._node):
                point = position_of(self._node, index)
                nearest = _nearest(self._locator, point)
                if ON_SURFACE_MM < np.linalg.norm(nearest - point) <= FAR_MM:
                    self._node.SetNthControlPointPositionWorld(index, *nearest)
        finally:
            self._busy = False


def name_clearly(node: Any) -> None:
    """Names that Slicer made up become "Landmark 1", "Landmark 2"; those of the user stay."""
    if node.GetControlPointLabelFormat() == SLICER_FORMAT:
        node.SetControlPointLabelFormat(FORMAT)
    for index in range(node.GetNumberOfControlPoints()):
        if node.GetNthControlPointLabel(index) in (f"{node.GetName()}-{index + 1}", ""):
            node.SetNthControlPointLabel(index, FORMAT % (index + 1))


def _locator(surface: vtk.vtkPolyData) -> vtk.vtkStaticCellLocator:
    if surface is None or surface.GetNumberOfCells() == 0:
        raise InputError("landmarks: the organ has no surface; choose the organ's segment first")
    key = (surface, surface.GetMTime())
    if _last.get("key") != key:
        locator = vtk.vtkStaticCellLocator()
        locator.SetDataSet(surface)
        locator.BuildLocator()
        _last.update(key=key, locator=locator)
    return _last["locator"]


def _nearest(locator: vtk.vtkStaticCellLocator, point: Array) -> Array:
    """The point (3,) of the surface nearest to ``point`` (3,), mm."""
    closest, cell, part, squared = [0.0, 0.0, 0.0], vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
    locator.FindClosestPoint(point, closest, cell, part, squared)
    return np.array(closest)
