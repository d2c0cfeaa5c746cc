"""Transforms of a case: CT to scene (elastic grid, then similarity), its inverse, and the splat in CT millimetres.

All in RAS mm and in Slicer's direction: a node placed under one of them is moved to the second frame of its name.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from ..inputs.matrices import matrix_of
from .case_record import CaseNodes
from .geometry import Array, scale_of
from .node_factory import ensure

KIND = "OrganPhys.Transform"
ELASTIC, SIMILARITY, PENDING = "elastic", "similarity", "similarity only: the elastic part is not sampled yet"
MB = 1e6


def write_transforms(case: CaseNodes, grids: Any) -> None:
    """Fill the three transform nodes for the last stage that is done; linear ones unless there are elastic grids."""
    record = case.record
    T_scene_ct = np.array(record["similarities"][record["stage"]])
    T_overlay_ct = np.array(record["T_overlay_scene"]) @ T_scene_ct
    forward, inverse, splat_to_ct = (ensure(case, role) for role in ("ct_to_scene", "scene_to_ct", "splat_to_ct_mm"))
    forward.SetAndObserveTransformNodeID(case.node("overlay_frame").GetID())
    splat_to_ct.SetMatrixTransformToParent(matrix_of(np.linalg.inv(T_scene_ct)))
    if grids is not None:
        set_composite(forward, grids.forward, T_overlay_ct, grid_first=True)
        set_composite(inverse, grids.inverse, np.linalg.inv(T_overlay_ct), grid_first=False)
    else:
        set_linear(forward, T_overlay_ct)
        set_linear(inverse, np.linalg.inv(T_overlay_ct))
    kind = ELASTIC if grids is not None else PENDING if record["stage"] == "elastic" else SIMILARITY
    _state(forward, kind, scale_of(T_overlay_ct), None if grids is None else grids.forward)
    _state(inverse, kind, scale_of(T_overlay_ct), None if grids is None else grids.inverse)


def set_linear(node: Any, matrix: Array) -> None:
    """To-parent matrix (4, 4), also for a node that holds a composite now (SetMatrixTransformToParent refuses that)."""
    linear = vtk.vtkTransform()
    linear.SetMatrix(matrix_of(matrix))
    node.SetAndObserveTransformToParent(linear)


def set_composite(node: Any, grid: Any, matrix: Array, *, grid_first: bool) -> None:
    """To-parent transform of a displacement grid and a similarity (4, 4), in the order given."""
    linear = vtk.vtkTransform()
    linear.SetMatrix(matrix_of(matrix))
    both = vtk.vtkGeneralTransform()
    both.PostMultiply()
    for part in (grid_transform(grid), linear) if grid_first else (linear, grid_transform(grid)):
        both.Concatenate(part)
    node.SetAndObserveTransformToParent(both)


def grid_transform(grid: Any) -> Any:
    """A ``DisplacementGrid`` as VTK transform; plain vtkGridTransform could not be saved by Slicer.

    Cubic between the nodes, as Slicer reads it from a file: the same result before and after saving.
    """
    vectors = np.asarray(grid.vectors)
    image = vtk.vtkImageData()
    image.SetOrigin(*map(float, grid.origin))
    image.SetSpacing(*map(float, grid.spacing))
    image.SetDimensions(*vectors.shape[2::-1])
    data = numpy_to_vtk(np.ascontiguousarray(vectors).reshape(-1, 3), deep=True)
    data.SetName("displacement_mm")
    image.GetPointData().SetScalars(data)
    transform = slicer.vtkOrientedGridTransform()
    transform.SetDisplacementGridData(image)
    transform.SetInterpolationModeToCubic()
    return transform


def grid_rows(grids: Any) -> list[tuple[str, float, str]]:
    """Metric, value and unit of how well the grids stand for the mapping, for the metrics table."""
    rows = []
    for name, grid in (("CT to scene", grids.forward), ("scene to CT", grids.inverse)):
        rows += [
            (f"{name}: sampling error inside, largest", float(grid.error_mm["max"]), "mm"),
            (f"{name}: sampling error inside, 95 %", float(grid.error_mm["p95"]), "mm"),
            (f"{name}: sampling error within 30 mm outside, largest", float(grid.error_outside_mm["max"]), "mm"),
            (f"{name}: grid spacing", float(np.max(grid.spacing)), "mm"),
            (f"{name}: grid memory", np.asarray(grid.vectors).nbytes / MB, "MB"),
        ]
    return rows


def _state(node: Any, kind: str, scale: float, grid: Any) -> None:
    """What the transform is and how exact, as attributes that are saved with it."""
    facts: dict[str, Any] = {KIND: kind, "OrganPhys.ScaleRatio": f"{scale:.6g}"}
    for name in ("SamplingErrorMaxMm", "SamplingErrorP95Mm", "SamplingErrorOutsideMaxMm", "GridSpacingMm", "GridMB"):
        facts[f"OrganPhys.{name}"] = None
    if grid is not None:
        facts |= {
            "OrganPhys.SamplingErrorMaxMm": f"{grid.error_mm['max']:.4g}",
            "OrganPhys.SamplingErrorP95Mm": f"{grid.error_mm['p95']:.4g}",
            "OrganPhys.SamplingErrorOutsideMaxMm": f"{grid.error_outside_mm['max']:.4g}",
            "OrganPhys.GridSpacingMm": f"{float(np.max(grid.spacing)):.4g}",
            "OrganPhys.GridMB": f"{np.asarray(grid.vectors).nbytes / MB:.3g}",
        }
    for name, value in facts.items():
        if value is None:
            node.RemoveAttribute(name)
        else:
            node.SetAttribute(name, value)
