"""Content of one node, kept aside so that it can be put back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..inputs.matrices import matrix_of, to_parent
from .case_record import CaseNodes
from .node_factory import add_to_folder, followers

REFERENCES = ("segmentation", "splat", "overlay_frame")


@dataclass(frozen=True)
class SavedNode:
    """One node with its content. Data objects are kept, not copied: writing gives nodes new ones and changes none.

    followers: its display and storage nodes. A node that is removed can be added again: it keeps its ID and its
    references, as long as it went before the nodes it refers to.
    """

    node: Any
    followers: tuple[Any, ...]
    name: str
    attributes: dict[str, str]
    data: Any
    parent: str | None
    references: dict[str, str | None]
    displays: tuple[tuple[bool, tuple[float, float]], ...]


def save_node(node: Any) -> SavedNode:
    """Content of a node of a case."""
    displays = [node.GetNthDisplayNode(k) for k in range(_displays(node))]
    return SavedNode(
        node=node,
        followers=tuple(followers(node)),
        name=node.GetName(),
        attributes=attributes_of(node),
        data=_data(node),
        parent=node.GetTransformNodeID() if node.IsA("vtkMRMLTransformableNode") else None,
        references={role: node.GetNodeReferenceID(role) for role in REFERENCES},
        displays=tuple((bool(one.GetVisibility()), tuple(one.GetScalarRange())) for one in displays),
    )


def restore_node(case: CaseNodes, saved: SavedNode) -> None:
    """Give a node its content back; one that was removed is added again."""
    node = saved.node
    if not case.scene.IsNodePresent(node):
        for follower in saved.followers:
            case.scene.AddNode(follower)
        case.scene.AddNode(node)
        add_to_folder(case, node)
    node.SetName(saved.name)
    if saved.data is not None and saved.data is not _data(node):
        _set_data(node, saved.data)
    if node.IsA("vtkMRMLTransformableNode"):
        node.SetAndObserveTransformNodeID(saved.parent)
    for role, identifier in saved.references.items():
        if node.GetNodeReferenceID(role) != identifier:
            node.SetNodeReferenceID(role, identifier)
    for k, (visible, limits) in enumerate(saved.displays[: _displays(node)]):
        node.GetNthDisplayNode(k).SetVisibility(visible)
        node.GetNthDisplayNode(k).SetScalarRange(limits)
    for name in {*saved.attributes, *attributes_of(node)}:
        set_attribute(node, name, saved.attributes.get(name))


def _data(node: Any) -> Any:
    if node.IsA("vtkMRMLLinearTransformNode"):
        return to_parent(node)
    if node.IsA("vtkMRMLTransformNode"):
        return node.GetTransformToParent()
    if node.IsA("vtkMRMLModelNode"):
        return node.GetMesh()
    return node.GetTable() if node.IsA("vtkMRMLTableNode") else None


def _set_data(node: Any, data: Any) -> None:
    if node.IsA("vtkMRMLLinearTransformNode"):
        node.SetMatrixTransformToParent(matrix_of(data))
    elif node.IsA("vtkMRMLTransformNode"):
        node.SetAndObserveTransformToParent(data)
    elif node.IsA("vtkMRMLModelNode"):
        node.SetAndObserveMesh(data)
    else:
        node.SetAndObserveTable(data)


def _displays(node: Any) -> int:
    return int(node.GetNumberOfDisplayNodes()) if node.IsA("vtkMRMLModelNode") else 0


def attributes_of(node: Any) -> dict[str, str]:
    """All attributes of a node."""
    return {name: node.GetAttribute(name) for name in node.GetAttributeNames()}


def set_attribute(node: Any, name: str, value: str | None) -> None:
    """Set an attribute, or remove it (None), without an event where nothing changes."""
    if value is None:
        node.RemoveAttribute(name)
    elif node.GetAttribute(name) != value:
        node.SetAttribute(name, value)
