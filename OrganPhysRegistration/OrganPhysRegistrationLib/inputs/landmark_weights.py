"""The Hann weights of the landmarks, 0 to 1, as colours on the organ: which tissue the start of the fit relies on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import InputError

from .landmark_list import landmark_points
from .matrices import ROLE
from .organ_surface import organ_surface

WEIGHTS = "landmark_weights"
COLOURS = "landmark_weight_colours"
NAME = "Landmark weight"
LIFT_MM = 0.3  # above the segment's own surface, which lies in the same place
LOW, HIGH = np.array([0.55, 0.57, 0.60]), np.array([1.0, 0.45, 0.0])


@dataclass(frozen=True)
class WeightsShown:
    """A coloured organ model of its own; radius_mm: reach of a landmark, given or chosen by the method."""

    node: Any
    radius_mm: float

    def remove(self) -> None:
        """Take it out of the scene with all that came with it."""
        for node in _nodes_of("vtkMRMLModelNode", WEIGHTS):
            followers = [node.GetNthDisplayNode(k) for k in range(node.GetNumberOfDisplayNodes())]  # and its legend
            for each in (node, *followers):
                slicer.mrmlScene.RemoveNode(each)
        for node in _nodes_of("vtkMRMLColorTableNode", COLOURS):
            slicer.mrmlScene.RemoveNode(node)


def show_weights(
    segmentation_node: Any, segment_id: str, landmarks_node: Any, radius_mm: float | None = None
) -> WeightsShown:
    """Show the weights of the placed landmarks on the organ, with a colour legend; a second call updates the first.

    ``radius_mm``: reach of each landmark, None lets the method choose. The model is not saved with the scene.
    InputError: no landmark placed, no organ.
    """
    from organphys.pipeline.landmark_weights import landmark_weights

    positions, _ = landmark_points(landmarks_node)
    if len(positions) == 0:
        raise InputError("landmarks: none placed yet; place one or two on the part of the organ that the splat shows")
    surface = organ_surface(segmentation_node, segment_id)
    points = vtk_to_numpy(surface.GetPoints().GetData()).astype(np.float64)
    weights, reach_mm = landmark_weights(points, positions, radius_mm)
    node = next(iter(_nodes_of("vtkMRMLModelNode", WEIGHTS)), None) or _new_node()
    node.SetAndObserveMesh(_lifted(surface, points, weights))
    return WeightsShown(node, float(reach_mm))


def _lifted(surface: vtk.vtkPolyData, points: Any, weights: Any) -> vtk.vtkPolyData:
    """The surface a little outside of itself with the weights as its scalars."""
    oriented = vtk.vtkPolyDataNormals()
    oriented.SetInputData(surface)
    oriented.SplittingOff()
    oriented.ConsistencyOff()
    oriented.Update()
    mesh = vtk.vtkPolyData()
    mesh.DeepCopy(oriented.GetOutput())
    normals = vtk_to_numpy(mesh.GetPointData().GetNormals())
    lifted = vtk.vtkPoints()
    lifted.SetData(numpy_to_vtk((points + LIFT_MM * normals).astype(np.float32), deep=True))
    mesh.SetPoints(lifted)
    scalars = numpy_to_vtk(np.asarray(weights, dtype=np.float32), deep=True)
    scalars.SetName(NAME)
    mesh.GetPointData().SetScalars(scalars)
    return mesh


def _new_node() -> Any:
    scene = slicer.mrmlScene
    node = slicer.vtkMRMLModelNode()
    node.SetName("Landmark weights")
    node.SetAttribute(ROLE, WEIGHTS)
    node.SetSaveWithScene(False)
    node.SetHideFromEditors(True)
    scene.AddNode(node)
    node.CreateDefaultDisplayNodes()
    display = node.GetDisplayNode()
    display.SetSaveWithScene(False)
    display.SetVisibility2D(False)
    display.SetActiveScalar(NAME, vtk.vtkAssignAttribute.POINT_DATA)
    display.SetAndObserveColorNodeID(_colours().GetID())
    display.SetScalarRangeFlag(slicer.vtkMRMLDisplayNode.UseManualScalarRange)
    display.SetScalarRange(0.0, 1.0)
    display.SetScalarVisibility(True)
    legend = slicer.modules.colors.logic().AddDefaultColorLegendDisplayNode(display)
    legend.SetTitleText(NAME)
    legend.SetLabelFormat("%.2f")
    legend.SetSaveWithScene(False)
    return node


def _colours() -> Any:
    """Grey where a landmark has no say to orange where it counts fully."""
    table = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLColorTableNode", "Landmark weight colours")
    table.SetAttribute(ROLE, COLOURS)
    table.SetSaveWithScene(False)
    table.SetHideFromEditors(True)
    table.SetTypeToUser()
    table.SetNumberOfColors(256)
    for k, share in enumerate(np.linspace(0, 1, 256)):
        table.SetColor(k, f"{share:.3f}", *(LOW + share * (HIGH - LOW)), 1.0)
    return table


def _nodes_of(node_class: str, role: str) -> list[Any]:
    return [node for node in slicer.util.getNodesByClass(node_class) if node.GetAttribute(ROLE) == role]
