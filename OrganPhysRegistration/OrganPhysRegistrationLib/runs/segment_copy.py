"""One segment in a segmentation node of its own, so that it can be moved without the others."""

from __future__ import annotations

from typing import Any

import slicer

from ..inputs.segment_checks import checked_segment


def copy_segment(segmentation_node: Any, segment_id: str) -> Any:
    """A new vtkMRMLSegmentationNode with this segment alone, in the same place; InputError if there is none."""
    segment = checked_segment(segmentation_node, segment_id)
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLSegmentationNode", segment.GetName())
    node.CreateDefaultDisplayNodes()
    source, copy = segmentation_node.GetSegmentation(), node.GetSegmentation()
    copy.SetSourceRepresentationName(source.GetSourceRepresentationName())
    copy.CopyConversionParameters(source)
    copy.CopySegmentFromSegmentation(source, segment_id)
    node.SetAndObserveTransformNodeID(segmentation_node.GetTransformNodeID())
    return node
