"""Section 1, first part: organ, splat and crop box."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

from .section import Section, guarded
from .segmentation_shortcuts import offer


class InputsSection(Section):
    """Segment selector, splat selector with its Load button, crop box, sample data."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        offer(ui.segmentWithButton)
        ui.splatSelector.addAttribute("vtkMRMLModelNode", "OrganPhys.Splat", "1")
        ui.segmentSelector.connect("currentNodeChanged(vtkMRMLNode*)", self._segmentation_chosen)
        ui.segmentSelector.connect("currentSegmentChanged(QString)", self._segment_chosen)
        ui.loadSplatButton.connect("clicked()", self.choose_splat_file)
        ui.sampleDataButton.connect("clicked()", self.load_sample_case)
        self._showing = False
        self._segmentation: Any = None

    def bind(self) -> None:
        self._observe(None)

    def refresh(self) -> None:
        selector, chosen = self.ui.segmentSelector, self.panel.parameters
        self._observe(chosen.segmentation)
        self._showing = True
        try:
            if selector.currentNode() is not chosen.segmentation:
                selector.setCurrentNode(chosen.segmentation)
            if chosen.segmentation is not None and selector.currentSegmentID() != chosen.segmentID:
                selector.setCurrentSegmentID(chosen.segmentID)
        finally:
            self._showing = False

    @guarded
    def choose_splat_file(self) -> None:
        """Ask for a PLY file and load it."""
        path = qt.QFileDialog.getOpenFileName(
            slicer.util.mainWindow(), _("Load Gaussian splat"), "", _("Gaussian splat") + " (*.ply)"
        )
        if path:
            self.load_splat(path)

    def load_splat(self, path: str) -> None:
        """Load a splat and choose it."""
        with slicer.util.WaitCursor():
            self.panel.parameters.splat = self.panel.logic.loadSplat(path)
        self.panel.tell("")

    @guarded
    def load_sample_case(self) -> None:
        """Load the generated case and choose its nodes."""
        self.panel.tell(_("Loading the sample case. The first time it is made, which takes some seconds."))
        with slicer.util.WaitCursor():
            self.panel.choose(self.panel.logic.loadSampleCase())
        self.panel.tell("")

    def _observe(self, segmentation: Any) -> None:
        """An empty segment that is painted, or one that is removed, changes what is possible."""
        if segmentation is self._segmentation:
            return
        kinds = slicer.vtkSegmentation
        for event in (kinds.SegmentAdded, kinds.SegmentRemoved, kinds.SourceRepresentationModified):
            if self._segmentation is not None:
                self.removeObserver(self._segmentation, event, self.panel.refresh_soon)
            if segmentation is not None:
                self.addObserver(segmentation, event, self.panel.refresh_soon)
        self._segmentation = segmentation

    def _segmentation_chosen(self, node: Any) -> None:
        if not self._showing and self.panel.parameters is not None:
            segment_id = self.ui.segmentSelector.currentSegmentID() if node is not None else ""
            self.panel.choose({"segmentation": node, "segmentID": segment_id or ""})

    def _segment_chosen(self, segment_id: str) -> None:
        if not self._showing and self.panel.parameters is not None:
            self.panel.parameters.segmentID = segment_id or ""
