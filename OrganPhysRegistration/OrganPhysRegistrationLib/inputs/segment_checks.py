"""Whether a segment can be registered: it is there, something is painted in it, and its parents do not mirror it."""

from __future__ import annotations

from typing import Any

import numpy as np

from organphys.ground.checks import Array, InputError

from .label_image import LabelImage
from .matrices import world_from_node

LABELMAP = "Binary labelmap"

_last: dict[str, Any] = {}  # the last label that was searched: the panel asks at every refresh


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


def checked_place(segmentation_node: Any) -> Array:
    """T_world_node (4, 4) of a segmentation under linear parents; InputError if they mirror or flatten the organ."""
    T_world_node = world_from_node(segmentation_node)
    if not np.linalg.det(T_world_node[:3, :3]) > 0:
        raise InputError(
            f"{segmentation_node.GetName()}: its parent transform mirrors or flattens the organ; take it out of the "
            "transform or correct that"
        )
    return T_world_node


def is_empty(segmentation_node: Any, segment_id: str | None) -> bool:
    """Whether there is no such segment or nothing is painted in it. Label maps are searched once after each change."""
    if segmentation_node is None or not segment_id:
        return True
    content = segmentation_node.GetSegmentation()
    segment = content.GetSegment(segment_id) if content is not None else None
    if segment is None:
        return True
    image = segment.GetRepresentation(LABELMAP)
    if image is None or content.GetSourceRepresentationName() != LABELMAP:
        bounds = [0.0] * 6
        segment.GetBounds(bounds)
        return bounds[0] > bounds[1]
    key = (image, image.GetMTime(), segment.GetLabelValue())
    if _last.get("key") != key:
        _last.update(key=key, empty=LabelImage(image, segment.GetLabelValue()).box is None)
    return bool(_last["empty"])
