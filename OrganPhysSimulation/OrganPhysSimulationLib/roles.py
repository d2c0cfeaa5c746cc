"""Nodes of the simulation, found by an attribute that they keep through saving and loading."""

from __future__ import annotations

from typing import Any

import slicer

ROLE = "OrganPhys.SimulationRole"
LINEAR, MODEL = "vtkMRMLLinearTransformNode", "vtkMRMLModelNode"
KINDS = {  # role: class, name
    "frame": (LINEAR, "Simulation frame"),
    "tool": (LINEAR, "Instrument (drag me)"),
    "surface": (MODEL, "Simulated organ"),
    "instrument": (MODEL, "Instrument"),
    "trocar": (MODEL, "Trocar"),
    "pin_balls": (MODEL, "Pinned regions"),
    "points": (MODEL, "Moving splat (points)"),
    "colours": ("vtkMRMLColorTableNode", "Simulation colours"),
    "gravity": ("vtkMRMLMarkupsLineNode", "Gravity"),
}
OF_A_RUN = ("surface", "instrument", "trocar", "pin_balls", "points", "tool", "gravity", "colours", "frame")


def find(role: str) -> Any:
    """The node with this role, or None."""
    name = KINDS[role][0]
    for node in slicer.util.getNodesByClass(name):
        if node.GetAttribute(ROLE) == role:
            return node
    return None


def ensure(role: str) -> Any:
    """The node with this role, made if there is none."""
    found = find(role)
    if found is not None:
        return found
    kind, name = KINDS[role]
    node = slicer.mrmlScene.CreateNodeByClass(kind)
    node.UnRegister(None)
    node.SetName(name)
    node.SetAttribute(ROLE, role)
    node.SetHideFromEditors(role in ("frame", "colours"))
    node = slicer.mrmlScene.AddNode(node)
    if kind == MODEL or role in ("tool", "gravity"):
        node.CreateDefaultDisplayNodes()
    return node


def remove_all() -> None:
    """Remove the nodes of a run with their displays; sequences and what the user made stay."""
    from OrganPhysRegistrationLib.outputs.node_factory import remove

    for role in OF_A_RUN:
        kind = slicer.util.getNodesByClass(KINDS[role][0])
        for node in [node for node in kind if node.GetAttribute(ROLE) == role]:
            remove(slicer.mrmlScene, node)
