"""VTK transforms that Slicer can save: displacement grids, similarities and both in a row."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer
import vtk
from vtk.util.numpy_support import numpy_to_vtk

from ..inputs.matrices import matrix_of
from .geometry import Array

INVERSE_MM = 0.01  # VTK's Newton steps end here; also what a transform has that was read from a file


def linear(matrix: Array) -> Any:
    """vtkTransform of a (4, 4)."""
    transform = vtk.vtkTransform()
    transform.SetMatrix(matrix_of(matrix))
    return transform


def composite(first: Any, second: Any) -> Any:
    """``first``, then ``second``."""
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
