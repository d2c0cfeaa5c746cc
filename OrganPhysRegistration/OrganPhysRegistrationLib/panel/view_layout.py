"""The layout with the CT slices and the 3D overlay side by side."""

from __future__ import annotations

import slicer

LAYOUT_ID = 7310  # above 100: free for extensions
SLICES = (
    ("Red", "Axial", "R", "#F34A33"),
    ("Green", "Coronal", "G", "#6EB04B"),
    ("Yellow", "Sagittal", "Y", "#EDD54C"),
)


def show_layout() -> int:
    """Switch to the layout, registering it in the scene's layout node where that is not done yet; returns its id."""
    manager = slicer.app.layoutManager()
    node = manager.layoutLogic().GetLayoutNode()
    if not node.IsLayoutDescription(LAYOUT_ID):
        node.AddLayoutDescription(LAYOUT_ID, layout_description())
    manager.setLayout(LAYOUT_ID)
    return LAYOUT_ID


def layout_description() -> str:
    """Three slices one above the other on the left, one 3D view on the right."""
    return (
        '<layout type="horizontal" split="true"><item splitSize="350"><layout type="vertical">'
        + "".join(f"<item>{_slice(*view)}</item>" for view in SLICES)
        + '</layout></item><item splitSize="650"><view class="vtkMRMLViewNode" singletontag="1">'
        '<property name="viewlabel" action="default">1</property></view></item></layout>'
    )


def _slice(name: str, orientation: str, label: str, colour: str) -> str:
    return (
        f'<view class="vtkMRMLSliceNode" singletontag="{name}">'
        f'<property name="orientation" action="default">{orientation}</property>'
        f'<property name="viewlabel" action="default">{label}</property>'
        f'<property name="viewcolor" action="default">{colour}</property></view>'
    )
