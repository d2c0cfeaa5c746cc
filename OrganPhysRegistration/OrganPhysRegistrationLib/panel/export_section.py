"""Section 4, second part: carrying other nodes along, and files."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from .section import Section, guarded


class ExportSection(Section):
    """Puts a node under the transform CT to scene; writes surface, transform, asset and report."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        self._buttons = (ui.exportSurfaceButton, ui.exportTransformButton, ui.exportAssetButton, ui.exportReportButton)
        ui.applyTransformButton.connect("clicked()", self.apply_transform)
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
        self.ui.applyTransformButton.enabled = (
            case is not None and self.ui.transformedNodeSelector.currentNode() is not None
        )

    @guarded
    def apply_transform(self) -> None:
        """Carry the chosen node into the endoscope's scene."""
        node = self.ui.transformedNodeSelector.currentNode()
        self.panel.logic.applyTransform(self.panel.case(), node)
        text = _("{name} now moves with the organ. Its parent transform in the Data module is CT to scene.")
        self.panel.tell(text.format(name=node.GetName()), "good")

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
