"""One segment of a segmentation node as a voxel mask with its place in the world (RAS mm)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer
import vtk
from numpy.typing import NDArray

from organphys.ground.checks import Array, InputError

from .label_image import LabelImage
from .matrices import apply_matrix, array_of
from .segment_checks import LABELMAP, checked_place, checked_segment

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
    labels = _label_image(segmentation_node, segment_id)
    border = _reference_extent(segmentation_node, labels.image)
    parent = segmentation_node.GetParentTransformNode()
    T_world_node = np.eye(4)
    if parent is not None and not parent.IsTransformToWorldLinear():
        labels, border = _warped(labels, parent), None
    else:
        T_world_node = checked_place(segmentation_node)
    box = labels.box
    if box is None:
        raise InputError(f"segment {segment.GetName()}: it is empty; paint the organ or choose another segment")
    wide = box + np.array([-MARGIN, MARGIN])
    if border is not None:  # paint may lie outside the reference volume
        wide[:, 0] = np.maximum(wide[:, 0], np.minimum(border[:, 0], box[:, 0]))
        wide[:, 1] = np.minimum(wide[:, 1], np.maximum(border[:, 1], box[:, 1]))
    ijk_to_ras = T_world_node @ labels.T_node_ijk
    ijk_to_ras[:3, 3] = apply_matrix(ijk_to_ras, wide[:, 0])
    return SegmentMask(labels.mask(wide), ijk_to_ras, segment.GetName())


def private_copy(segmentation_node: Any, segment_id: str) -> Any:
    """A vtkSegmentation outside the scene that holds this segment alone; representations can be made in it."""
    source, copy = segmentation_node.GetSegmentation(), slicer.vtkSegmentation()
    copy.SetSourceRepresentationName(source.GetSourceRepresentationName())
    copy.CopyConversionParameters(source)
    copy.CopySegmentFromSegmentation(source, segment_id)
    return copy


def _label_image(node: Any, segment_id: str) -> LabelImage:
    """The segment's label map in the node's own frame; made on a copy where the segment is a surface only."""
    segment = node.GetSegmentation().GetSegment(segment_id)
    image = segment.GetRepresentation(LABELMAP)
    if image is None:
        copy = private_copy(node, segment_id)
        copy.CreateRepresentation(LABELMAP)
        segment = copy.GetSegment(segment_id)
        image = segment.GetRepresentation(LABELMAP) or slicer.vtkOrientedImageData()
    return LabelImage(image, segment.GetLabelValue())


def _warped(labels: LabelImage, parent: Any) -> LabelImage:
    """The segment resampled in the world through non-linear parents; its own box only, to save time."""
    if labels.box is None:
        return labels
    alone = labels.alone(labels.box + np.array([-MARGIN, MARGIN]))
    to_world = vtk.vtkGeneralTransform()
    parent.GetTransformToWorld(to_world)
    slicer.vtkOrientedImageDataResample.TransformOrientedImage(alone.image, to_world)
    return LabelImage(alone.image, alone.value)


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
