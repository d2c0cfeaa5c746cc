"""surface.vtp: the registered organ surface in the scene frame, with figures per point."""

from __future__ import annotations

import os

import numpy as np

from ..asset.registered_organ import RegisteredOrgan
from ..ground.atomic_file import write_bytes
from ..ground.checks import Array, InputError
from .vtk_xml import polydata_bytes


def write_surface_vtp(path: str | os.PathLike[str], organ: RegisteredOrgan, distance_mm: Array | None = None) -> None:
    """Write vertices in scene units with the point arrays, atomically.

    distance_mm: to the splat, as given (Nv,), NaN where unknown; displacement_mm: 3-vector beyond the similarity,
    millimetres along the CT axes (RAS); det_F: volume ratio; error_68_mm, error_95_mm: radius within which the true
    position lies with that probability, where the organ carries its uncertainty. The field-data string SPACE=RAS keeps
    3D Slicer from turning the surface against the splat. VTK is loaded here and without any rendering module.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    vertices, faces = organ.surface(frame="scene")
    distance = np.full(len(vertices), np.nan) if distance_mm is None else np.asarray(distance_mm, dtype=np.float64)
    if distance.shape != (len(vertices),):
        raise InputError(f"distance_mm: expected one number for each of {len(vertices)} vertices, got {distance.shape}")
    points, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(vertices), deep=True))
    offsets = np.arange(0, 3 * len(faces) + 1, 3, dtype=np.int64)
    cells.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(faces.ravel(), deep=True))
    data.SetPoints(points)
    data.SetPolys(cells)
    arrays: tuple[tuple[str, Array], ...] = (
        ("distance_mm", distance),
        ("displacement_mm", organ.surface_displacement_mm),
        ("det_F", organ.surface_det_f),
    )
    if organ.uncertainty is not None:
        arrays += (("error_68_mm", organ.surface_error_mm(0.68)), ("error_95_mm", organ.surface_error_mm(0.95)))
    for name, values in arrays:
        array = numpy_to_vtk(np.ascontiguousarray(values, dtype=np.float32), deep=True)
        array.SetName(name)
        data.GetPointData().AddArray(array)
    space = vtkStringArray()
    space.SetName("SPACE")
    space.InsertNextValue("RAS")
    data.GetFieldData().AddArray(space)
    write_bytes(path, polydata_bytes(data))
