"""One segment of a segmentation node as a voxel mask with its place in the world (RAS mm)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer
import vtk
from numpy.typing import NDArray

from organphys.ground.checks import Array, InputError

from .matrices import apply_matrix, array_of, world_from_node

LABELMAP = "Binary labelmap"
MARGIN = 1  # empty voxels kept round the organ where the volume goes on


@dataclass(frozen=True)
class SegmentMask:
    """mask (K, J, I) bool; ijk_to_ras (4, 4): voxel (i, j, k) -> world mm, may shear; name of the segment.

    The mask is cropped to the organ and a margin of one voxel. It reaches an edge of the array only where it reaches
    the border of the segmentation's reference volume.
    """

    mask: NDArray[np.bool_]
    ijk_to_ras: Array
    name: str


def segment_mask(segmentation_node: Any, segment_id: str | None) -> SegmentMask:
    """Voxels of one segment alone, also where several segments share a label map.

    Parent transforms of the segmentation are honoured: linear ones in the affine, others by resampling a copy. The
    node is not changed. InputError: nothing chosen, segment missing or empty.
    """
    segment = checked_segment(segmentation_node, segment_id)
    image = _own_labelmap(segmentation_node, segment_id)
    border: NDArray[np.int64] | None = _reference_extent(segmentation_node, image)
    parent = segmentation_node.GetParentTransformNode()
    T_world_node = np.eye(4)
    if parent is not None and not parent.IsTransformToWorldLinear():
        image, border = _warped(image, parent), None
    else:
        T_world_node = world_from_node(segmentation_node)
    voxels, first = _voxels(image)
    if not voxels.any():
        raise InputError(f"segment {segment.GetName()}: it is empty; paint the organ or choose another segment")
    mask, corner = _cropped(voxels, first, border)
    ijk_to_node = vtk.vtkMatrix4x4()
    image.GetImageToWorldMatrix(ijk_to_node)
    ijk_to_ras = T_world_node @ array_of(ijk_to_node)
    ijk_to_ras[:3, 3] = apply_matrix(ijk_to_ras, corner)
    return SegmentMask(mask, ijk_to_ras, segment.GetName())


def checked_segment(segmentation_node: Any, segment_id: str | None) -> Any:
    """The vtkSegment, or InputError that says what to choose."""
    if segmentation_node is None:
        raise InputError("organ: no segmentation chosen; choose the segmentation of the CT or load a label map as one")
    if not segmentation_node.IsA("vtkMRMLSegmentationNode"):
        raise InputError(f"organ: {segmentation_node.GetName()} is no segmentation; choose one")
    if not segment_id:
        raise InputError("organ: no segment chosen; choose the organ's segment")
    segmentation = segmentation_node.GetSegmentation()
    segment = segmentation.GetSegment(segment_id) if segmentation is not None else None
    if segment is None:
        raise InputError(
            f"organ: {segmentation_node.GetName()} has no segment {segment_id!r} (any more); choose the organ again"
        )
    return segment


def private_copy(segmentation_node: Any, segment_id: str) -> Any:
    """A vtkSegmentation outside the scene that holds this segment alone; representations can be made in it."""
    source, copy = segmentation_node.GetSegmentation(), slicer.vtkSegmentation()
    copy.SetSourceRepresentationName(source.GetSourceRepresentationName())
    copy.CopyConversionParameters(source)
    copy.CopySegmentFromSegmentation(source, segment_id)
    return copy


def _own_labelmap(node: Any, segment_id: str) -> Any:
    """vtkOrientedImageData, 0/1, of this segment alone, in the node's own frame."""
    image = slicer.vtkOrientedImageData()
    segment = node.GetSegmentation().GetSegment(segment_id)
    if segment.GetRepresentation(LABELMAP) is not None:
        node.GetBinaryLabelmapRepresentation(segment_id, image)
        return image
    copy = private_copy(node, segment_id)
    if copy.CreateRepresentation(LABELMAP):
        made = copy.GetSegment(segment_id).GetRepresentation(LABELMAP)
        if made is not None:
            image.DeepCopy(made)
    return image


def _warped(image: Any, parent: Any) -> Any:
    """The label map resampled in the world through non-linear parents; the organ's box alone, to save time."""
    voxels, first = _voxels(image)
    if voxels.any():
        box = _occupied(voxels) + first[:, None] + np.array([-MARGIN, MARGIN])
        slicer.vtkOrientedImageDataResample.CopyImage(image, image, box.ravel().tolist())
    to_world = vtk.vtkGeneralTransform()
    parent.GetTransformToWorld(to_world)
    slicer.vtkOrientedImageDataResample.TransformOrientedImage(image, to_world)
    return image


def _voxels(image: Any) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Mask (K, J, I) over the image's extent and the index (i, j, k) of its first voxel."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    extent = np.array(image.GetExtent(), dtype=np.int64).reshape(3, 2)
    shape = np.ptp(extent, axis=1) + 1
    scalars = image.GetPointData().GetScalars()
    if (shape < 1).any() or scalars is None:
        return np.zeros((0, 0, 0), dtype=bool), extent[:, 0]
    return vtk_to_numpy(scalars).reshape(shape[::-1]) != 0, extent[:, 0]


def _reference_extent(node: Any, image: Any) -> NDArray[np.int64] | None:
    """Extent (3, 2), i j k, of the reference volume on the label map's own grid; None where none is recorded."""
    converter = slicer.vtkSegmentationConverter
    text = node.GetSegmentation().GetConversionParameter(converter.GetReferenceImageGeometryParameterName())
    reference = slicer.vtkOrientedImageData()
    if not text or not converter.DeserializeImageGeometry(text, reference, False):
        return None
    extent = np.array(reference.GetExtent(), dtype=np.float64).reshape(3, 2)
    if (np.ptp(extent, axis=1) < 0).any():
        return None
    to_node, from_node = vtk.vtkMatrix4x4(), vtk.vtkMatrix4x4()
    reference.GetImageToWorldMatrix(to_node)
    image.GetWorldToImageMatrix(from_node)
    edges = extent + np.array([-0.5, 0.5])  # from voxel centres to the outer faces
    corners = np.stack(np.meshgrid(*edges, indexing="ij"), -1).reshape(-1, 3)
    corners = apply_matrix(array_of(from_node) @ array_of(to_node), corners)
    return np.stack([np.rint(corners.min(0) + 0.5), np.rint(corners.max(0) - 0.5)], axis=1).astype(np.int64)


def _cropped(
    voxels: NDArray[np.bool_], first: NDArray[np.int64], border: NDArray[np.int64] | None
) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Mask (K, J, I) of the occupied box with its margin, which ends at ``border``; index (i, j, k) of its corner."""
    box = _occupied(voxels) + first[:, None]
    wide = box + np.array([-MARGIN, MARGIN])
    if border is not None:  # paint may lie outside the reference volume
        wide[:, 0] = np.maximum(wide[:, 0], np.minimum(border[:, 0], box[:, 0]))
        wide[:, 1] = np.minimum(wide[:, 1], np.maximum(border[:, 1], box[:, 1]))
    mask = np.zeros((np.ptp(wide, axis=1) + 1)[::-1], dtype=bool)
    inner, outer = box - first[:, None], box - wide[:, :1]
    mask[_slices(outer)] = voxels[_slices(inner)]
    return mask, wide[:, 0]


def _occupied(voxels: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Box (3, 2) in i, j, k, ends included, of the true voxels (K, J, I)."""
    occupied = [np.flatnonzero(voxels.any(axis=axes)) for axes in ((0, 1), (0, 2), (1, 2))]
    return np.array([[o[0], o[-1]] for o in occupied])


def _slices(box: NDArray[np.int64]) -> tuple[slice, ...]:
    """Slices (k, j, i) of a box (3, 2) in i, j, k, ends included."""
    return tuple(slice(int(low), int(high) + 1) for low, high in box[::-1])
