"""Section 4, second part: carrying other nodes along, and files."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from ..outputs.apply_transform import harden, take_out
from .section import Section, guarded


class ExportSection(Section):
    """Puts a node under the transform CT to scene; writes surface, transform, asset and report."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        self._buttons = (ui.exportSurfaceButton, ui.exportTransformButton, ui.exportAssetButton, ui.exportReportButton)
        ui.applyTransformButton.connect("clicked()", self.apply_transform)
        ui.hardenButton.connect("clicked()", self.harden)
        ui.transformedNodeSelector.connect("currentNodeChanged(vtkMRMLNode*)", self.panel.refresh_soon)
        ui.exportSurfaceButton.connect("clicked()", self.export_surface)
        ui.exportTransformButton.connect("clicked()", self.export_transform)
        ui.exportAssetButton.connect("clicked()", self.export_asset)
        ui.exportReportButton.connect("clicked()", self.export_report)

    def refresh(self) -> None:
        case = self.panel.case()
        for button in self._buttons:
            button.enabled = case is not None
        has_asset = case is not None and case.stage == "elastic"
        self.ui.exportAssetButton.enabled = self.ui.exportReportButton.enabled = has_asset
        node = self.ui.transformedNodeSelector.currentNode()
        self.ui.applyTransformButton.enabled = case is not None and node is not None
        carried = self._is_carried(node)
        self.ui.hardenButton.enabled = carried
        self.ui.applyTransformButton.text = _("Take out") if carried else _("Apply")

    @guarded
    def apply_transform(self) -> None:
        """Carry the chosen node into the endoscope's scene, or back into the CT if it is there."""
        case, node = self.panel.case(), self.ui.transformedNodeSelector.currentNode()
        if self._is_carried(node):
            take_out(case, node)
            text = _("{name} lies in the CT again.")
        else:
            self.panel.logic.applyTransform(case, node, keepParent=True)
            text = _("{name} now follows the organ: it stands under the transform CT to scene.")
        self.panel.tell(text.format(name=node.GetName()), "good")
        self.panel.refresh()

    @guarded
    def harden(self) -> None:
        """Write the transform into the node's data; it stays where it is shown."""
        node = self.ui.transformedNodeSelector.currentNode()
        with slicer.util.WaitCursor():
            harden(self.panel.case(), node)
        self.panel.tell(_("{name} was hardened: its own data are deformed now.").format(name=node.GetName()), "good")
        self.panel.refresh()

    def _is_carried(self, node: Any) -> bool:
        """Whether the node stands under the case's transform CT to scene."""
        case = self.panel.case()
        transform = case.get("ct_to_scene") if case is not None else None
        parent = node.GetParentTransformNode() if node is not None else None
        while parent is not None and parent is not transform:
            parent = parent.GetParentTransformNode()
        return parent is not None

    @guarded
    def export_surface(self) -> None:
        """Registered surface, RAS world mm, as a mesh file."""
        self._export("surface", _("Export surface"), _("Surface") + " (*.stl *.ply *.vtp)")

    @guarded
    def export_transform(self) -> None:
        """Transform CT to scene as a file that Slicer loads again."""
        self._export("transform", _("Export transform"), _("Transform") + " (*.h5 *.nrrd)")

    @guarded
    def export_asset(self) -> None:
        """The registered organ for simulation."""
        self._export("asset", _("Export asset"), _("Registered organ") + " (*.organphys)")

    @guarded
    def export_report(self) -> None:
        """Folder with report.html."""
        folder = qt.QFileDialog.getExistingDirectory(slicer.util.mainWindow(), _("Folder for the report"))
        if folder:
            self._write("report", folder)

    def _export(self, what: str, title: str, kinds: str) -> None:
        path = qt.QFileDialog.getSaveFileName(slicer.util.mainWindow(), title, "", kinds)
        if path:
            self._write(what, path)

    def _write(self, what: str, path: str) -> None:
        with slicer.util.WaitCursor():
            written = self.panel.logic.export(self.panel.case(), what, path)
        self.panel.tell(_("Written: {path}").format(path=written), "good")
