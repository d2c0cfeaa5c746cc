"""What a run changes in the scene, as it was before: to undo a run, and to leave nothing behind when one fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..inputs.matrices import matrix_of
from ..inputs.splat_scale import scene_to_world
from .case_folder import remove_folders
from .case_record import CASE, ROLE, CaseNodes
from .geometry import to_parent
from .node_factory import add_to_folder, followers, remove

REFERENCES = ("segmentation", "splat", "overlay_frame")


@dataclass(frozen=True)
class _Saved:
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


class SceneSnapshot:
    """State of a case, which may not exist yet, and of its splat's scale and place."""

    def __init__(self, case: CaseNodes, splat: Any) -> None:
        self._case, self._splat = case, splat
        self._ids = {node.GetID() for node in _nodes(case.scene)}
        self._saved = [_save(node) for node in case.nodes()]
        mover = scene_to_world(splat)
        self._mover_parent = mover.GetTransformNodeID()
        self._mover_matrix = to_parent(mover)
        self._splat_attributes = _attributes(splat)

    def restore(self, *, drop_new_nodes: bool = False) -> None:
        """Put everything back. ``drop_new_nodes``: also remove every node that came into the scene since."""
        case, kept = self._case, [saved.node for saved in self._saved]
        self._restore_splat()
        for node in reversed(case.nodes()):
            if node not in kept:
                _remove_or_pass_on(case, node)
        for saved in self._saved:
            _restore(case, saved)
        if drop_new_nodes:
            for node in reversed(_nodes(case.scene)):
                if node.GetID() not in self._ids and case.scene.IsNodePresent(node):
                    remove(case.scene, node)
        if not kept:
            remove_folders(case.scene, case.case_id)

    def _restore_splat(self) -> None:
        mover = scene_to_world(self._splat)
        frame = mover.GetParentTransformNode()
        shared = frame is not None and frame.GetID() != self._mover_parent and _other_case(self._case) is not None
        if not shared:
            mover.SetAndObserveTransformNodeID(self._mover_parent)
            if not np.array_equal(to_parent(mover), self._mover_matrix):
                mover.SetMatrixTransformToParent(matrix_of(self._mover_matrix))
            _set_attributes(self._splat, self._splat_attributes)


def remove_case(case: CaseNodes) -> None:
    """Remove all nodes of a case and its folder. The splat stays where it is; nodes under its transforms get none."""
    splat = case.splat
    for node in reversed(case.nodes()):
        if node.GetAttribute(ROLE) == "overlay_frame" and splat is not None and _other_case(case) is None:
            scene_to_world(splat).SetAndObserveTransformNodeID(node.GetTransformNodeID())
        _remove_or_pass_on(case, node)
    remove_folders(case.scene, case.case_id)


def _other_case(case: CaseNodes) -> CaseNodes | None:
    """Another case that stands in the same overlay frame."""
    frame = case.get("overlay_frame")
    others = [one for one in CaseNodes.all(case.scene) if one.case_id != case.case_id]
    return next((one for one in others if frame is not None and one.get("overlay_frame") is frame), None)


def _remove_or_pass_on(case: CaseNodes, node: Any) -> None:
    """Remove a node; an overlay frame that another organ on the same splat needs becomes that one's."""
    other = _other_case(case) if node.GetAttribute(ROLE) == "overlay_frame" else None
    if other is None:
        remove(case.scene, node)
    else:
        node.SetAttribute(CASE, other.case_id)


def _save(node: Any) -> _Saved:
    displays = [node.GetNthDisplayNode(k) for k in range(_displays(node))]
    return _Saved(
        node=node,
        followers=tuple(followers(node)),
        name=node.GetName(),
        attributes=_attributes(node),
        data=_data(node),
        parent=node.GetTransformNodeID() if node.IsA("vtkMRMLTransformableNode") else None,
        references={role: node.GetNodeReferenceID(role) for role in REFERENCES},
        displays=tuple((bool(one.GetVisibility()), tuple(one.GetScalarRange())) for one in displays),
    )


def _restore(case: CaseNodes, saved: _Saved) -> None:
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
    _set_attributes(node, saved.attributes)


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


def _attributes(node: Any) -> dict[str, str]:
    return {name: node.GetAttribute(name) for name in node.GetAttributeNames()}


def _set_attributes(node: Any, attributes: dict[str, str]) -> None:
    for name in node.GetAttributeNames():
        if name not in attributes:
            node.RemoveAttribute(name)
    for name, value in attributes.items():
        if node.GetAttribute(name) != value:
            node.SetAttribute(name, value)


def _nodes(scene: Any) -> list[Any]:
    return [scene.GetNthNode(k) for k in range(scene.GetNumberOfNodes())]
