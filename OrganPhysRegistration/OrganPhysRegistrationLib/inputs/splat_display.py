"""What of a splat is shown: only the polydata's vertex cells are rewritten, points and arrays stay as they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray, vtk_to_numpy

from organphys.ground.checks import as_positive
from organphys.points.point_sets import Box

COLOUR = "colour"
POINT_SIZE = 4.0  # pixels


def create_display(node: Any, *, point_size: float = POINT_SIZE) -> Any:
    """Display node that shows the Gaussians' own colours as points, unlit, in 3D only."""
    node.CreateDefaultDisplayNodes()
    display = node.GetDisplayNode()
    display.SetRepresentation(slicer.vtkMRMLDisplayNode.PointsRepresentation)
    display.SetPointSize(point_size)
    display.SetLighting(False)
    display.SetBackfaceCulling(False)
    display.SetVisibility2D(False)
    show_colours(node, COLOUR)
    return display


def show_colours(node: Any, array: str) -> None:
    """Colour the points by a (N, 3) uint8 array, taken as RGB without a colour table."""
    display = node.GetDisplayNode()
    display.SetScalarRangeFlag(slicer.vtkMRMLDisplayNode.UseDirectMapping)
    display.SetActiveScalar(array, vtk.vtkAssignAttribute.POINT_DATA)
    display.SetScalarVisibility(True)


def set_point_size(node: Any, point_size: float) -> None:
    """Size of the points on the screen in pixels."""
    node.GetDisplayNode().SetPointSize(as_positive(point_size, "point size"))


def visible_gaussians(node: Any, *, opacity: float = 0.1, box: Box | None = None) -> NDArray[np.bool_]:
    """(N,) bool: finite Gaussians above the opacity threshold and inside the box (scene units).

    The rule of registration (organphys.points.target_selection.select_target); none may be left here.
    """
    poly = node.GetPolyData()
    values = {name: vtk_to_numpy(poly.GetPointData().GetArray(name)) for name in ("valid", "opacity")}
    chosen = (values["valid"] != 0) & (values["opacity"] > opacity)
    if box is not None:
        rows = np.flatnonzero(chosen)
        points = vtk_to_numpy(poly.GetPoints().GetData())[rows].astype(np.float64)
        chosen[rows[~box.contains(points)]] = False
    return chosen


def show_gaussians(node: Any, shown: NDArray[np.bool_]) -> int:
    """Show the Gaussians ``shown`` (N,) bool and hide the others; returns how many are shown."""
    rows = np.flatnonzero(shown).astype(np.int64)
    cells = vtk.vtkCellArray()
    offsets = np.arange(len(rows) + 1, dtype=np.int64)
    cells.SetData(numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(rows, deep=True))
    poly = node.GetPolyData()
    poly.SetVerts(cells)
    poly.Modified()
    return len(rows)


def shown_gaussians(node: Any) -> NDArray[np.bool_]:
    """(N,) bool: which Gaussians are shown now."""
    poly = node.GetPolyData()
    shown = np.zeros(poly.GetNumberOfPoints(), dtype=bool)
    if poly.GetNumberOfVerts():
        shown[vtk_to_numpy(poly.GetVerts().GetConnectivityArray())] = True
    return shown


def show_everything(node: Any) -> int:
    """Show all finite Gaussians, also the transparent ones; returns how many."""
    return show_gaussians(node, vtk_to_numpy(node.GetPolyData().GetPointData().GetArray("valid")) != 0)
