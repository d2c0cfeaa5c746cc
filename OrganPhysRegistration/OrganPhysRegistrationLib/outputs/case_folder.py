"""One subject-hierarchy folder per case, with a folder for plots and tables in it."""

from __future__ import annotations

from typing import Any

import slicer

from .case_record import CASE, CaseNodes

PLOTS = "Plots and tables"


def subject_hierarchy(scene: Any) -> Any:
    """The subject hierarchy node of the scene, made if there is none."""
    return slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(scene)


def case_folder(case: CaseNodes, part: str = "") -> int:
    """Item of the case's folder, or of a folder in it, made at first use."""
    tree = subject_hierarchy(case.scene)
    uid = f"{case.case_id}/{part}" if part else case.case_id
    item = tree.GetItemByUID(CASE, uid)
    if not item:
        parent = case_folder(case) if part else tree.GetSceneItemID()
        item = tree.CreateFolderItem(parent, part or f"OrganPhys: {case.name}")
        tree.SetItemUID(item, CASE, uid)
        tree.SetItemExpanded(item, not part)
    return int(item)


def put_into_folder(case: CaseNodes, node: Any, part: str = "") -> None:
    """Place a new node in the case's folder; outside the application its item is made here."""
    tree = subject_hierarchy(case.scene)
    item = tree.GetItemByDataNode(node) or tree.CreateItem(case_folder(case, part), node)
    tree.SetItemParent(item, case_folder(case, part))


def remove_folders(scene: Any, case_id: str) -> None:
    """Remove the case's folders; what the user has put in them moves up, no node is deleted."""
    tree = subject_hierarchy(scene)
    for uid in (f"{case_id}/{PLOTS}", case_id):
        item = tree.GetItemByUID(CASE, uid)
        if item:
            _move_children_up(tree, item)
            tree.RemoveItem(item, False, False)


def _move_children_up(tree: Any, item: int) -> None:
    from vtk import vtkIdList

    children = vtkIdList()
    tree.GetItemChildren(item, children, False)
    for k in range(children.GetNumberOfIds()):
        tree.SetItemParent(children.GetId(k), tree.GetItemParent(item))
