"""A segmentation's label maps through a deformation, whole.

Slicer's own hardening sizes the new label map by two opposite corners of a box: with oblique axes it cuts pieces off
(13 % of the volume of prostate_a), and it inverts the transform at every voxel of that box.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import vtk
from numpy.typing import NDArray
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from ..inputs.matrices import apply_matrix, array_of
from .geometry import Array

LABELS, SURFACE = "Binary labelmap", "Closed surface"
REACH = (
    2  # voxels round a mapped voxel that may belong to it too: enough while the organ is stretched less than fourfold
)


def deform_segmentation(segmentation: Any, transform: Any) -> None:
    """Replace the label maps of a segmentation node by their deformed ones, nearest neighbour, on the same voxel axes.

    transform: VTK transform of the node's own coordinates, mm to mm, with an inverse.
    """
    content, done = segmentation.GetSegmentation(), []
    had_surface = content.ContainsRepresentation(SURFACE)
    for k in range(content.GetNumberOfSegments()):
        image = content.GetNthSegment(k).GetRepresentation(LABELS)
        if image is not None and image not in done:  # several segments may share a label map
            done.append(image)
            _deform(image, transform)
    content.InvalidateNonSourceRepresentations()
    if had_surface:
        segmentation.CreateClosedSurfaceRepresentation()


def _deform(image: Any, transform: Any) -> None:
    scalars, matrix = image.GetPointData().GetScalars(), vtk.vtkMatrix4x4()
    if scalars is None or not image.GetNumberOfPoints():
        return
    image.GetImageToWorldMatrix(matrix)
    T_world_image = array_of(matrix)
    labels = vtk_to_numpy(scalars).reshape(image.GetDimensions()[::-1]).transpose(2, 1, 0)
    first = np.array(image.GetExtent())[::2]
    labelled = np.argwhere(labels) + first
    if not len(labelled):
        return
    landed = np.rint(_through(transform, labelled, T_world_image)).astype(np.int64)
    low, high = landed.min(0) - REACH, landed.max(0) + REACH
    candidates = _neighbourhood(landed - low, high - low + 1)
    places = np.argwhere(candidates)
    source = np.rint(_through(transform.GetInverse(), places + low, T_world_image)).astype(np.int64) - first
    within = ((source >= 0) & (source < labels.shape)).all(1)
    out = np.zeros(candidates.shape, dtype=labels.dtype)
    out[tuple(places[within].T)] = labels[tuple(source[within].T)]
    image.SetExtent(*map(int, np.stack([low, high], axis=1).ravel()))
    moved = numpy_to_vtk(out.transpose(2, 1, 0).ravel(), deep=True, array_type=scalars.GetDataType())
    moved.SetName(scalars.GetName())
    image.GetPointData().SetScalars(moved)
    image.Modified()


def _neighbourhood(voxels: NDArray[np.int64], shape: Any) -> NDArray[np.bool_]:
    """Whether each voxel of a grid is one of the voxels (N, 3) or at most REACH away from one along every axis."""
    near = np.zeros(shape, dtype=bool)
    near[tuple(voxels.T)] = True
    for axis in range(3):
        view, spread = np.moveaxis(near, axis, 0), np.moveaxis(near.copy(), axis, 0)
        for step in range(1, REACH + 1):
            view[step:] |= spread[:-step]
            view[:-step] |= spread[step:]
    return near


def _through(transform: Any, voxels: Any, T_world_image: Array) -> Array:
    """Voxel indices (N, 3), real numbers, of voxel indices (N, 3) after the transform."""
    source, target = vtk.vtkPoints(), vtk.vtkPoints()
    source.SetData(numpy_to_vtk(np.ascontiguousarray(apply_matrix(T_world_image, voxels)), deep=True))
    target.SetDataTypeToDouble()
    transform.TransformPoints(source, target)
    return apply_matrix(np.linalg.inv(T_world_image), vtk_to_numpy(target.GetData()))
