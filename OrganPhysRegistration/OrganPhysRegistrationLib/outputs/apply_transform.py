"""Bringing any other node, a tumour, vessels, the CT itself, from the CT to the registered organ."""

from __future__ import annotations

from typing import Any

import vtk

from organphys.ground.checks import InputError

from .case_record import CASE, ROLE, CaseNodes
from .deformed_labels import LABELS, deform_segmentation
from .overlay_frame import frame_above

KEPT_PARENT = "OrganPhys.KeptParent"


def apply_to(case: CaseNodes, node: Any, *, keep_parent: bool = False) -> None:
    """Put a node that lies in the CT under the case's CT-to-scene transform: it is shown where the organ is now.

    Its data stay as they are until the user hardens the transform. A node with another parent transform is refused with
    InputError, or with ``keep_parent`` stands under a copy of that parent, which stands under the transform.
    """
    transform, parent = case.node("ct_to_scene"), _checked(node).GetParentTransformNode()
    if _stands_under(node, transform):
        return
    if frame_above(node) is not None or node is case.splat:
        raise InputError(f"{node.GetName()}: belongs to the endoscope side already; choose a node of the CT")
    if parent is None:
        node.SetAndObserveTransformNodeID(transform.GetID())
    elif keep_parent:
        copy = _copy_of_parents(case, node, parent)
        copy.SetAndObserveTransformNodeID(transform.GetID())
        node.SetAndObserveTransformNodeID(copy.GetID())
    else:
        raise InputError(
            f"{node.GetName()}: stands under the transform {parent.GetName()}; keep it (it is then applied first), "
            "or harden it, or take the node out of it"
        )


def harden(case: CaseNodes, node: Any) -> None:
    """Write the transform of ``apply_to`` into the node's data and take it out; it stays where it is shown.

    Use this rather than Slicer's own hardening for segmentations: that one may cut pieces off (see deformed_labels).
    """
    parent = node.GetParentTransformNode()
    if not _stands_under(node, case.node("ct_to_scene")):
        raise InputError(f"{node.GetName()}: does not stand under {case.node('ct_to_scene').GetName()}; apply it first")
    if node.IsA("vtkMRMLSegmentationNode") and _holds_labels(node):
        to_world = vtk.vtkGeneralTransform()
        parent.GetTransformToWorld(to_world)
        deform_segmentation(node, to_world)
        node.SetAndObserveTransformNodeID(None)
    else:
        node.HardenTransform()
    if parent.GetNodeReferenceID(KEPT_PARENT) is not None:
        case.scene.RemoveNode(parent)


def take_out(case: CaseNodes, node: Any) -> None:
    """Undo ``apply_to``: the node stands in the CT again, under the parent that it had."""
    transform, parent = case.node("ct_to_scene"), node.GetParentTransformNode()
    if not _stands_under(node, transform):
        raise InputError(f"{node.GetName()}: does not stand under {transform.GetName()}")
    if parent is transform:
        node.SetAndObserveTransformNodeID(None)
        return
    if parent.GetNodeReferenceID(KEPT_PARENT) is None:
        raise InputError(f"{node.GetName()}: stands under {parent.GetName()}, which OrganPhys has not put there")
    node.SetAndObserveTransformNodeID(parent.GetNodeReferenceID(KEPT_PARENT))
    case.scene.RemoveNode(parent)


def _checked(node: Any) -> Any:
    if node is None:
        raise InputError("apply transform: no node chosen; choose a segmentation, model, volume or markup of the CT")
    if not node.IsA("vtkMRMLTransformableNode") or not node.CanApplyNonLinearTransforms():
        raise InputError(f"{node.GetName()}: cannot follow a deformation; choose a segmentation, model or volume")
    if node.GetAttribute(CASE) and node.GetAttribute(ROLE):
        raise InputError(f"{node.GetName()}: is a result of the registration itself; choose a node of the CT")
    return node


def _holds_labels(segmentation: Any) -> bool:
    return str(segmentation.GetSegmentation().GetSourceRepresentationName()) == LABELS


def _stands_under(node: Any, transform: Any) -> bool:
    parent = node.GetParentTransformNode()
    while parent is not None and parent is not transform:
        parent = parent.GetParentTransformNode()
    return parent is transform


def _copy_of_parents(case: CaseNodes, node: Any, parent: Any) -> Any:
    """What the parents of a node do to it, in a transform of its own: others under those parents stay in place."""
    to_world = vtk.vtkGeneralTransform()
    parent.GetTransformToWorld(to_world)
    still = vtk.vtkGeneralTransform()
    still.DeepCopy(to_world)
    copy = case.scene.AddNewNodeByClass("vtkMRMLTransformNode", f"{parent.GetName()}, kept for {node.GetName()}")
    matrix = vtk.vtkMatrix4x4()
    if parent.GetMatrixTransformToWorld(matrix):
        copy.SetMatrixTransformToParent(matrix)
    else:
        copy.SetAndObserveTransformToParent(still)
    copy.SetNodeReferenceID(KEPT_PARENT, parent.GetID())
    return copy
