"""What a run changes in the scene, as it was before: to undo a run, and to leave nothing behind when one fails."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..inputs.matrices import matrix_of, to_parent
from ..inputs.splat_scale import scene_to_world
from .case_folder import remove_folders
from .case_record import CASE, ROLE, CaseNodes
from .node_content import attributes_of, restore_node, save_node, set_attribute
from .node_factory import remove


class SceneSnapshot:
    """State of a case, which may not exist yet, and of its splat's scale and place."""

    def __init__(self, case: CaseNodes, splat: Any) -> None:
        self._case, self._splat = case, splat
        self._ids = {node.GetID() for node in _nodes(case.scene)}
        self._saved = [save_node(node) for node in case.nodes()]
        mover = scene_to_world(splat)
        self._mover_parent = mover.GetTransformNodeID()
        self._mover_matrix = to_parent(mover)
        self._scale = _scale_attributes(splat)

    def restore(self, *, drop_new_nodes: bool = False) -> None:
        """Put everything back. ``drop_new_nodes``: also remove every node that came into the scene since."""
        case, kept = self._case, [saved.node for saved in self._saved]
        self._restore_splat()
        for node in reversed(case.nodes()):
            if node not in kept:
                _remove_or_pass_on(case, node)
        for saved in self._saved:
            restore_node(case, saved)
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
            for name in {*self._scale, *_scale_attributes(self._splat)}:
                set_attribute(self._splat, name, self._scale.get(name))


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


def _scale_attributes(splat: Any) -> dict[str, str]:
    return {name: value for name, value in attributes_of(splat).items() if name.startswith("OrganPhys.MmPerUnit")}


def _nodes(scene: Any) -> list[Any]:
    return list(scene.GetNodes())
