"""Makes and removes the nodes of a case: a role's node is made once and filled again by every later run."""

from __future__ import annotations

from typing import Any, NamedTuple

from .case_folder import PLOTS, put_into_folder, subject_hierarchy
from .case_record import CASE, ROLE, CaseNodes

TRANSFORM, LINEAR = "vtkMRMLTransformNode", "vtkMRMLLinearTransformNode"
MODEL, TABLE = "vtkMRMLModelNode", "vtkMRMLTableNode"
SERIES, CHART = "vtkMRMLPlotSeriesNode", "vtkMRMLPlotChartNode"


class Kind(NamedTuple):
    """Class of a role's node, what its name says after the case's, and the folder within the case's folder."""

    node_class: str
    title: str
    part: str = ""


KINDS = {
    "case": Kind("vtkMRMLScriptedModuleNode", ""),
    "colours": Kind("vtkMRMLColorTableNode", "distance colours"),
    "overlay_frame": Kind(LINEAR, "overlay frame"),
    "surface_before": Kind(MODEL, "surface (before)"),
    "surface_coarse": Kind(MODEL, "surface (coarse)"),
    "surface_rigid": Kind(MODEL, "surface (rigid)"),
    "surface_elastic": Kind(MODEL, "surface (elastic)"),
    "volume": Kind(MODEL, "displaced volume points"),
    "ct_to_scene": Kind(TRANSFORM, "CT to scene"),
    "scene_to_ct": Kind(TRANSFORM, "scene to CT"),
    "splat_to_ct_mm": Kind(LINEAR, "splat in CT millimetres"),
    "metrics": Kind(TABLE, "metrics"),
    "convergence_table": Kind(TABLE, "elastic steps", PLOTS),
    "twist_table": Kind(TABLE, "twist search", PLOTS),
    "chosen_twist_table": Kind(TABLE, "chosen twist", PLOTS),
    "series_splat_to_ct": Kind(SERIES, "splat to organ", PLOTS),
    "series_ct_to_splat": Kind(SERIES, "organ to splat", PLOTS),
    "series_volume": Kind(SERIES, "volume drift", PLOTS),
    "series_twist": Kind(SERIES, "cost of each twist", PLOTS),
    "series_chosen_twist": Kind(SERIES, "chosen", PLOTS),
    "convergence_chart": Kind(CHART, "convergence", PLOTS),
    "volume_chart": Kind(CHART, "volume drift plot", PLOTS),
    "twist_chart": Kind(CHART, "twist search plot", PLOTS),
}
HIDDEN = ("case", "colours")


def ensure(case: CaseNodes, role: str) -> Any:
    """The node of a role, made in the case's folder if the case has none."""
    found = case.get(role)
    if found is not None:
        return found
    kind = KINDS[role]
    node = case.scene.CreateNodeByClass(kind.node_class)
    node.UnRegister(None)
    node.SetName(f"{case.name} {kind.title}" if kind.title else "OrganPhys case")
    node.SetAttribute(CASE, case.case_id)
    node.SetAttribute(ROLE, role)
    node.SetHideFromEditors(role in HIDDEN)
    node = case.scene.AddNode(node)
    if kind.node_class == MODEL:
        node.CreateDefaultDisplayNodes()
    add_to_folder(case, node)
    return node


def add_to_folder(case: CaseNodes, node: Any) -> None:
    """Place a node of the case in its folder, unless it is one that users do not see."""
    role = node.GetAttribute(ROLE)
    if role not in HIDDEN:
        put_into_folder(case, node, KINDS[role].part)


def followers(node: Any) -> list[Any]:
    """Display nodes (colour legends are some) and storage nodes of a node."""
    found = []
    if node.IsA("vtkMRMLDisplayableNode"):
        found += [node.GetNthDisplayNode(k) for k in range(node.GetNumberOfDisplayNodes())]
    if node.IsA("vtkMRMLStorableNode"):
        found += [node.GetNthStorageNode(k) for k in range(node.GetNumberOfStorageNodes())]
    return [one for one in found if one is not None]


def remove(scene: Any, node: Any) -> None:
    """Remove a node with its followers, which RemoveNode leaves behind, and its place in the subject hierarchy."""
    tree, others = subject_hierarchy(scene), followers(node)
    scene.RemoveNode(node)
    item = tree.GetItemByDataNode(node)  # in the application it went with the node
    if item:
        tree.RemoveItem(item, False, False)
    for other in others:
        if scene.IsNodePresent(other):
            scene.RemoveNode(other)


def remove_role(case: CaseNodes, role: str) -> None:
    """Remove a role's node if there is one."""
    node = case.get(role)
    if node is not None:
        remove(case.scene, node)
