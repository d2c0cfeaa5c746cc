"""The transform node against the core's own map: where both put the points inside the organ."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import Array

from .inputs.matrices import apply_matrix
from .inputs.splat_scale import T_shown_scene
from .outputs.case_record import CaseNodes
from .outputs.volume_node import asset_of


def mapped_and_expected(case: CaseNodes, splat: Any) -> tuple[Array, Array, Array]:
    """Volume points (N, 3) of the CT, RAS mm; where the node CT to scene puts them in the world, mm; and where the
    registered organ does."""
    organ = asset_of(case)
    points_ct = np.asarray(organ.volume_points, dtype=np.float64)
    expected = apply_matrix(T_shown_scene(splat), organ.map_points(points_ct))
    return points_ct, in_world(case.node("ct_to_scene"), points_ct), expected


def in_world(transform_node: Any, points: Array) -> Array:
    """Points (N, 3) of a node under this transform in the world, RAS mm."""
    to_world = vtk.vtkGeneralTransform()
    transform_node.GetTransformToWorld(to_world)
    before, after = vtk.vtkPoints(), vtk.vtkPoints()
    after.SetDataTypeToDouble()
    before.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float64), deep=True))
    to_world.TransformPoints(before, after)
    moved: Array = vtk_to_numpy(after.GetData()).copy()
    return moved
