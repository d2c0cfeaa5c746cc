"""A Slicer ROI placed round a part of the splat, as a box in raw scene units."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk

from organphys.ground.checks import InputError
from organphys.points.point_sets import Box

from .matrices import apply_matrix, array_of, world_from_node
from .splat_node import T_shown_scene, checked_splat


def scene_box(roi_node: Any, splat_node: Any) -> Box | None:
    """Oriented box (scene units) of an ROI as it lies round the shown splat; None without an ROI.

    Rotation and linear parent transforms of both nodes are honoured. InputError: not placed, or sheared.
    """
    if roi_node is None:
        return None
    checked_splat(splat_node)
    name = roi_node.GetName()
    if not roi_node.IsA("vtkMRMLMarkupsROINode"):
        raise InputError(f"region of interest: {name} is no ROI; choose a box ROI")
    size = np.array(roi_node.GetSize())
    if roi_node.GetNumberOfDefinedControlPoints() == 0 or not (size > 0).all():
        raise InputError(f"region of interest: {name} is not placed yet; draw it round the organ in the splat")
    to_node = vtk.vtkMatrix4x4()
    to_node.DeepCopy(roi_node.GetObjectToNodeMatrix())
    T_scene_object = np.linalg.inv(T_shown_scene(splat_node)) @ world_from_node(roi_node) @ array_of(to_node)
    edges = T_scene_object[:3, :3] * size  # columns
    lengths = np.linalg.norm(edges, axis=0)
    axes = (edges / lengths).T
    if not np.allclose(axes @ axes.T, np.eye(3), atol=1e-3):
        raise InputError(f"region of interest: {name} is sheared by its parent transforms; take it out of them")
    return Box(apply_matrix(T_scene_object, np.zeros(3)), lengths, axes)
