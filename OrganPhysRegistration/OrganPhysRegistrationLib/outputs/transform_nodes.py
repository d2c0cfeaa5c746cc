"""Transforms of a case: CT to scene (elastic grid, then similarity), its inverse, and the splat in CT millimetres.

All in RAS mm and in Slicer's direction: a node placed under one of them is moved to the second frame of its name. The
inverse solves the forward grid at every point (VTK's Newton steps, to 0.01 mm) and is saved and loaded as such: a
second grid, sampled from the inverse, would be off by up to some tenths of a millimetre where the organ folds.
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
from .node_content import set_attribute
from .node_factory import ensure

KIND = "OrganPhys.Transform"
ELASTIC, SIMILARITY, PENDING = "elastic", "similarity", "similarity only: the elastic part is not sampled yet"
MB = 1e6
INVERSE_MM = 0.01


def write_transforms(case: CaseNodes, grids: Any) -> None:
    """Fill the three transform nodes for the last stage that is done; linear ones unless there are elastic grids."""
    record = case.record
    T_scene_ct = np.array(record["similarities"][record["stage"]])
    T_overlay_ct = np.array(record["T_overlay_scene"]) @ T_scene_ct
    forward, inverse, splat_to_ct = (ensure(case, role) for role in ("ct_to_scene", "scene_to_ct", "splat_to_ct_mm"))
    forward.SetAndObserveTransformNodeID(case.node("overlay_frame").GetID())
    splat_to_ct.SetMatrixTransformToParent(matrix_of(np.linalg.inv(T_scene_ct)))
    set_both(
        forward, inverse, T_overlay_ct, None if grids is None else grid_transform(displacement_image(grids.forward))
    )
    kind = ELASTIC if grids is not None else PENDING if record["stage"] == "elastic" else SIMILARITY
    for node in (forward, inverse):
        _state(node, kind, scale_of(T_overlay_ct), None if grids is None else grids.forward)


def set_both(forward: Any, inverse: Any, matrix: Array, grid: Any) -> None:
    """To-parent transforms of a node and of its inverse: a grid transform (None: none), then a similarity (4, 4)."""
    there, back = vtk.vtkTransform(), vtk.vtkTransform()
    there.SetMatrix(matrix_of(matrix))
    back.SetMatrix(matrix_of(np.linalg.inv(matrix)))
    if grid is None:  # SetMatrixTransformToParent would refuse a node that holds a composite
        forward.SetAndObserveTransformToParent(there)
        inverse.SetAndObserveTransformToParent(back)
        return
    forward.SetAndObserveTransformToParent(_composite(grid, there))
    undo = like_grid(grid, grid.GetDisplacementGrid(), invert=True)
    inverse.SetAndObserveTransformToParent(_composite(back, undo))


def _composite(first: Any, second: Any) -> Any:
    both = vtk.vtkGeneralTransform()
    both.PostMultiply()
    both.Concatenate(first)
    both.Concatenate(second)
    return both


def grid_transform(image: Any) -> Any:
    """Displacement image, mm, as VTK transform; plain vtkGridTransform could not be saved by Slicer.

    Cubic between the nodes, as Slicer reads it from a file: the same result before and after saving.
    """
    transform = slicer.vtkOrientedGridTransform()
    transform.SetDisplacementGridData(image)
    transform.SetInterpolationModeToCubic()
    transform.SetInverseTolerance(INVERSE_MM)
    return transform


def like_grid(grid: Any, image: Any, *, invert: bool = False) -> Any:
    """A new grid transform of ``image`` on the axes of another one, which may come from a file with turned axes."""
    transform = grid_transform(image)
    if grid.GetGridDirectionMatrix() is not None:
        transform.SetGridDirectionMatrix(grid.GetGridDirectionMatrix())
    if invert:
        transform.Inverse()
    return transform


def displacement_image(grid: Any) -> Any:
    """A ``DisplacementGrid`` as VTK image, mm."""
    vectors = np.asarray(grid.vectors)
    image = vtk.vtkImageData()
    image.SetOrigin(*map(float, grid.origin))
    image.SetSpacing(*map(float, grid.spacing))
    image.SetDimensions(*vectors.shape[2::-1])
    data = numpy_to_vtk(np.ascontiguousarray(vectors).reshape(-1, 3), deep=True)
    data.SetName("displacement_mm")
    image.GetPointData().SetScalars(data)
    return image


def grid_in(node: Any) -> Any:
    """The grid transform in a transform node of a case, None if the node is linear."""
    transform = node.GetTransformToParent()
    if not isinstance(transform, vtk.vtkGeneralTransform):
        return None
    parts = [transform.GetConcatenatedTransform(k) for k in range(transform.GetNumberOfConcatenatedTransforms())]
    return next((part for part in parts if part.IsA("vtkOrientedGridTransform")), None)


def grid_rows(grids: Any) -> list[tuple[str, float, str]]:
    """Metric, value and unit of how well the grid stands for the mapping, for the metrics table."""
    grid = grids.forward
    return [
        ("sampling error inside, largest", float(grid.error_mm["max"]), "mm"),
        ("sampling error inside, 95 %", float(grid.error_mm["p95"]), "mm"),
        ("sampling error within 30 mm outside, largest", float(grid.error_outside_mm["max"]), "mm"),
        ("inversion tolerance", INVERSE_MM, "mm"),
        ("grid spacing", float(np.max(grid.spacing)), "mm"),
        ("grid memory", np.asarray(grid.vectors).nbytes / MB, "MB"),
    ]


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
        set_attribute(node, name, value)
