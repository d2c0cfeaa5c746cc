"""The surface of a voxel mask: blurred iso-surface, outward faces, smoothed normals.

Uses VTK's filters without any rendering module. Boundary-voxel centres would lie half a voxel inside, which costs
3 % of scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..ground.checks import Array, InputError
from .mask_cleaning import Mask

BLUR_VOXELS = 0.7
ISO = 0.5
PADDING = 3  # the blur's reach, so that the surface closes
MAX_CELLS = 6_000_000  # finer grids are thinned while they are blurred


@dataclass(frozen=True)
class Surface:
    """Closed triangle mesh: vertices (Nv, 3), faces (Nf, 3) seen counter-clockwise from outside, normals (Nv, 3)."""

    vertices: Array
    faces: NDArray[np.int64]
    normals: Array


def surface_of_mask(mask: Mask, *, origin: Array, step: Array) -> Surface:
    """Surface of a mask (K, J, I) in the frame of ``origin`` (3,), the centre of voxel 0, and ``step`` (3, 3), whose
    columns are the voxel steps; any affine, also mirrored.

    The blur is 0.7 voxel along each axis (not 0.7 mm): it has to bridge the stairs between slices as they are.
    """
    grid, stride = _blurred(mask, np.linalg.norm(step, axis=0))
    index, faces = _iso_surface(grid)
    if len(faces) < 4:
        raise InputError(f"organ: {int(mask.sum())} voxels are too few for a surface; use a finer label map")
    vertices = (index * stride - PADDING) @ step.T + origin
    if signed_volume(vertices, faces) < 0:  # mirrored affine, or VTK's reversed axis order
        faces = faces[:, ::-1].copy()
    return Surface(vertices, faces, smoothed_normals(vertices, faces))


def signed_volume(vertices: Array, faces: NDArray[np.int64]) -> float:
    """Enclosed volume, positive where the faces run counter-clockwise seen from outside."""
    a, b, c = ((vertices - vertices.mean(0))[faces[:, k]] for k in range(3))
    return float(np.einsum("ni,ni->", a, np.cross(b, c))) / 6


def smoothed_normals(vertices: Array, faces: NDArray[np.int64], *, rounds: int = 2) -> Array:
    """Unit vertex normals (Nv, 3): area weighted, then ``rounds`` times the mean over the faces' vertices."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = _scatter(np.cross(b - a, c - a), faces, len(vertices))
    for _ in range(rounds):
        unit = _unit(normals)
        normals = _scatter(unit[faces[:, 0]] + unit[faces[:, 1]] + unit[faces[:, 2]], faces, len(vertices))
    return _unit(normals)


def _blurred(mask: Mask, spacing_mm: Array) -> tuple[NDArray[np.float32], Array]:
    """Padded mask blurred axis by axis, and the stride (3,) by which it was thinned: the finest axes first."""
    grid = np.pad(mask, PADDING).astype(np.float32)
    stride = _stride(grid.shape, spacing_mm)
    for axis in range(3):
        grid = ndimage.gaussian_filter1d(grid, BLUR_VOXELS, axis=axis, mode="constant")
        if stride[axis] > 1:
            grid = grid[tuple(slice(None, None, int(stride[axis])) if k == axis else slice(None) for k in range(3))]
    if (stride > 1).any():
        grid = np.pad(grid, [(0, 1)] * 3)  # the thinned grid may end inside the organ's blur
    return np.ascontiguousarray(grid), stride.astype(float)


def _stride(shape: tuple[int, ...], spacing_mm: Array) -> NDArray[np.int64]:
    stride = np.ones(3, dtype=np.int64)
    while np.prod(np.array(shape) / stride) > MAX_CELLS:
        stride[int((stride * spacing_mm).argmin())] += 1
    return stride


def _iso_surface(grid: NDArray[np.float32]) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (Nv, 3) in index units, in the grid's axis order, and faces (Nf, 3)."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    image = vtkImageData()
    image.SetDimensions(*grid.shape[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(grid.ravel()))
    contour = vtkFlyingEdges3D()
    contour.SetInputData(image)
    contour.SetValue(0, ISO)
    contour.ComputeNormalsOff()
    contour.ComputeGradientsOff()
    contour.ComputeScalarsOff()
    contour.Update()
    mesh = contour.GetOutput()
    if mesh.GetNumberOfPolys() == 0:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    vertices = vtk_to_numpy(mesh.GetPoints().GetData()).astype(np.float64)[:, ::-1]
    faces = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).astype(np.int64).reshape(-1, 3)
    return vertices, faces


def _scatter(values: Array, faces: NDArray[np.int64], count: int) -> Array:
    """Sum (count, 3) of per-face vectors (Nf, 3) over the faces' vertices."""
    corner = faces.T.ravel()
    return np.stack([np.bincount(corner, np.tile(values[:, k], 3), minlength=count) for k in range(3)], axis=1)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: Array = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return unit
