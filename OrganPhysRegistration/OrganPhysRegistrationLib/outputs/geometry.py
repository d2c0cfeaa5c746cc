"""Point sets, surfaces and similarities between numpy and VTK."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk
from numpy.typing import NDArray
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import Array

from ..inputs.matrices import scale_of, turn


def similarity_of(matrix: Any, centre: Any) -> Array:
    """Similarity (4, 4) nearest to an affine (4, 4) that does the same to the point ``centre`` (3,)."""
    m, centre = np.asarray(matrix, dtype=np.float64), np.asarray(centre, dtype=np.float64)
    u, singular, vt = np.linalg.svd(m[:3, :3])
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)]) @ vt
    out = np.eye(4)
    out[:3, :3] = np.cbrt(np.prod(singular)) * rotation
    out[:3, 3] = m[:3, :3] @ centre + m[:3, 3] - out[:3, :3] @ centre
    return out


def vtk_points(points: Any) -> vtk.vtkPoints:
    """(N, 3) in single precision: 0.0001 mm at a metre."""
    out = vtk.vtkPoints()
    out.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float32), deep=True))
    return out


def cells(rows: Any) -> vtk.vtkCellArray:
    """Cells of equal size from indices (N, k)."""
    rows = np.ascontiguousarray(rows, dtype=np.int64)
    out = vtk.vtkCellArray()
    offsets = np.arange(0, rows.size + 1, rows.shape[1], dtype=np.int64)
    out.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(rows.ravel(), deep=True))
    return out


def triangle_mesh(points: Any, triangles: vtk.vtkCellArray, normals: Any) -> vtk.vtkPolyData:
    """Surface with smooth shading; points and normals (N, 3)."""
    mesh, shading = vtk.vtkPolyData(), numpy_to_vtk(np.ascontiguousarray(normals, dtype=np.float32), deep=True)
    shading.SetName("Normals")
    mesh.SetPoints(vtk_points(points))
    mesh.SetPolys(triangles)
    mesh.GetPointData().SetNormals(shading)
    return mesh


def smooth_normals(points: Any, triangles: vtk.vtkCellArray) -> Array:
    """Unit normals (N, 3) of a surface's vertices."""
    mesh = vtk.vtkPolyData()
    mesh.SetPoints(vtk_points(points))
    mesh.SetPolys(triangles)
    normals = vtk.vtkPolyDataNormals()
    normals.SplittingOff()
    normals.ConsistencyOff()
    normals.SetInputData(mesh)
    normals.Update()
    return vtk_to_numpy(normals.GetOutput().GetPointData().GetNormals())


def turned(similarity: Any, directions: Any) -> Array:
    """Unit directions (N, 3) through the rotation of a similarity (4, 4)."""
    rotation = np.asarray(similarity)[:3, :3] / scale_of(similarity)
    return turn(rotation.astype(np.float32), np.asarray(directions))


def point_cloud(points: Any) -> vtk.vtkPolyData:
    """One vertex cell per point (N, 3)."""
    cloud = vtk.vtkPolyData()
    cloud.SetPoints(vtk_points(points))
    cloud.SetVerts(cells(np.arange(len(points))[:, None]))
    return cloud


def set_point_array(data: vtk.vtkPolyData, name: str, values: Any) -> None:
    """Point array of float32, (N,) or (N, k)."""
    array = numpy_to_vtk(np.ascontiguousarray(values, dtype=np.float32), deep=True)
    array.SetName(name)
    data.GetPointData().AddArray(array)


def points_of(data: vtk.vtkPolyData) -> Array:
    """Points (N, 3)."""
    return vtk_to_numpy(data.GetPoints().GetData()).astype(np.float64)


def triangles_of(data: vtk.vtkPolyData) -> NDArray[np.int64]:
    """Triangles (N, 3) of a pure triangle mesh."""
    return vtk_to_numpy(data.GetPolys().GetConnectivityArray()).astype(np.int64).reshape(-1, 3)
