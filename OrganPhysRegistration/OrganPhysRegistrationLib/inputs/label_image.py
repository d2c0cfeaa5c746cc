"""One label of a (shared) label map: where it is, and its voxels. The label map itself is not copied or changed."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import slicer
import vtk
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import Array

from .matrices import array_of

SLAB_VOXELS = 4_000_000  # compared at once, so that a whole-body CT needs no second volume


class LabelImage:
    """``image``: vtkOrientedImageData; ``value``: the voxels that count. Boxes are (3, 2) in i, j, k, ends included."""

    def __init__(self, image: Any, value: int) -> None:
        self.image, self.value = image, value

    @property
    def T_node_ijk(self) -> Array:
        """(4, 4) from voxel indices (i, j, k) to the segmentation's frame."""
        matrix = vtk.vtkMatrix4x4()
        self.image.GetImageToWorldMatrix(matrix)
        return array_of(matrix)

    @cached_property
    def box(self) -> NDArray[np.int64] | None:
        """Where the label is; None where it is nowhere."""
        voxels = self._voxels
        in_k, plane = np.zeros(len(voxels), dtype=bool), np.zeros(voxels.shape[1:], dtype=bool)
        rows = max(1, SLAB_VOXELS // max(1, plane.size))
        for start in range(0, len(voxels), rows):
            found = voxels[start : start + rows] == self.value
            in_k[start : start + rows] = found.reshape(len(found), -1).any(axis=1)
            plane |= found.any(axis=0)
        if not plane.any():
            return None
        occupied = [np.flatnonzero(line) for line in (plane.any(axis=0), plane.any(axis=1), in_k)]
        return np.array([[line[0], line[-1]] for line in occupied]) + self._first[:, None]

    def mask(self, wide: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(K, J, I) bool: the label within a box around its own, which may reach beyond the image."""
        mask = np.zeros((np.ptp(wide, axis=1) + 1)[::-1], dtype=bool)
        if self.box is not None:
            mask[_slices(self.box - wide[:, :1])] = self._voxels[_slices(self.box - self._first[:, None])] == self.value
        return mask

    def alone(self, wide: NDArray[np.int64]) -> LabelImage:
        """A label map of its own, 0 and 1, over a box around the label."""
        image, matrix = slicer.vtkOrientedImageData(), vtk.vtkMatrix4x4()
        self.image.GetImageToWorldMatrix(matrix)
        image.SetExtent(*(int(edge) for edge in wide.ravel()))
        image.SetImageToWorldMatrix(matrix)
        image.GetPointData().SetScalars(numpy_to_vtk(self.mask(wide).ravel().astype(np.uint8), deep=True))
        return LabelImage(image, 1)

    @cached_property
    def _first(self) -> NDArray[np.int64]:
        """Index (i, j, k) of the image's first voxel."""
        return np.array(self.image.GetExtent()[::2], dtype=np.int64)

    @cached_property
    def _voxels(self) -> NDArray[Any]:
        """View (K, J, I) of the image's voxels."""
        extent = np.array(self.image.GetExtent(), dtype=np.int64).reshape(3, 2)
        shape, scalars = np.ptp(extent, axis=1) + 1, self.image.GetPointData().GetScalars()
        if scalars is None or (extent[:, 1] < extent[:, 0]).any():
            return np.zeros((0, 0, 0), dtype=np.uint8)
        return vtk_to_numpy(scalars).reshape(shape[::-1])


def _slices(box: NDArray[np.int64]) -> tuple[slice, ...]:
    return tuple(slice(int(low), int(high) + 1) for low, high in box[::-1])
