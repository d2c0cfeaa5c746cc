"""Section 2: what of the splat is shown (and used), and where the overlay stands."""

from __future__ import annotations

from typing import Any

import slicer
import vtk
from slicer.i18n import tr as _

from ..choices import OverlayIn
from ..inputs import floaters, roi_input, splat_display
from ..inputs.splat_node import is_splat
from .choice_buttons import ChoiceButtons
from .section import Section, guarded


class DisplaySection(Section):
    """Opacity threshold, point size, crop and floaters of the splat; nothing of the file is changed."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        self._overlay = ChoiceButtons(
            {OverlayIn.Endoscope: ui.overlayEndoscopeButton, OverlayIn.CT: ui.overlayCtButton}, self.show_overlay
        )
        ui.previewFloatersButton.connect("toggled(bool)", self._toggle_preview)
        ui.showAllButton.connect("clicked()", self.show_all)
        self._roi: Any = None
        self._shown: tuple[Any, ...] | None = None

    def bind(self) -> None:
        self._observe_roi(None)
        self._shown = None

    def refresh(self) -> None:
        parameters, ui = self.panel.parameters, self.ui
        has_splat = parameters.splat is not None
        for widget in (ui.previewFloatersButton, ui.removeFloatersButton, ui.showAllButton):
            widget.enabled = has_splat
        if not has_splat:
            ui.previewFloatersButton.checked = False
        self._observe_roi(parameters.roi)
        case = self.panel.case()
        in_ct = case is not None and case.get("overlay_frame") is not None
        self._overlay.show(parameters.overlayIn, {OverlayIn.Endoscope: True, OverlayIn.CT: in_ct})
        ui.overlayEndoscopeButton.checked = parameters.overlayIn is OverlayIn.Endoscope or not in_ct
        ui.splatCountLabel.visible = has_splat
        if has_splat:
            self._show_splat()

    @guarded
    def show_overlay(self, where: OverlayIn) -> None:
        """Move splat and results together to the endoscope's scene or onto the CT."""
        from ..outputs.overlay_frame import set_overlay

        case = self.panel.case()
        if case is not None:
            set_overlay(case, where.value)
            self.panel.parameters.overlayIn = where
        self.panel.refresh_soon()

    @guarded
    def show_all(self) -> None:
        """No threshold, no crop, floaters kept."""
        parameters = self.panel.parameters
        with slicer.util.NodeModify(parameters.parameterNode):
            parameters.opacity, parameters.removeFloaters, parameters.roi = 0.0, False, None
        self.ui.previewFloatersButton.checked = False

    @guarded
    def _show_splat(self) -> None:
        parameters = self.panel.parameters
        if not is_splat(parameters.splat):  # what is wrong with it is told below the Register button
            return
        splat_display.set_point_size(parameters.splat, parameters.pointSize)
        splat, box = parameters.splat, roi_input.scene_box(self._placed_roi(), parameters.splat)
        crop = None if box is None else (*box.centre, *box.size, *box.axes.ravel())
        wanted = (splat.GetID(), splat.GetPolyData(), parameters.opacity, crop, parameters.removeFloaters)
        if wanted == self._shown:
            return
        self.ui.previewFloatersButton.checked = False
        self._shown = wanted
        choice = {"opacity": parameters.opacity, "box": box}
        with slicer.util.WaitCursor(parameters.removeFloaters):
            count = floaters.update_splat(splat, remove_floaters=parameters.removeFloaters, **choice)
        text = _("{shown:,} of {total:,} Gaussians shown and used")
        self.ui.splatCountLabel.text = text.format(shown=count, total=splat.GetPolyData().GetNumberOfPoints())

    @guarded
    def _toggle_preview(self, on: bool) -> None:
        parameters = self.panel.parameters
        if parameters is None or parameters.splat is None:
            return
        if on:
            box = roi_input.scene_box(self._placed_roi(), parameters.splat)
            with slicer.util.WaitCursor():
                count = floaters.preview_floaters(parameters.splat, opacity=parameters.opacity, box=box)
            self.ui.splatCountLabel.text = _("{count:,} floaters, shown in magenta").format(count=count)
        else:
            self._shown = None
            self.panel.refresh_soon()

    def _placed_roi(self) -> Any:
        """The crop box once it is drawn."""
        roi = self.panel.parameters.roi
        drawn = roi is not None and roi.GetNumberOfDefinedControlPoints() > 0 and min(roi.GetSize()) > 0
        return roi if drawn else None

    def _observe_roi(self, roi: Any) -> None:
        if roi is self._roi:
            return
        if self._roi is not None:
            self.removeObserver(self._roi, vtk.vtkCommand.ModifiedEvent, self.panel.refresh_soon)
        if roi is not None:
            self.addObserver(roi, vtk.vtkCommand.ModifiedEvent, self.panel.refresh_soon)
        self._roi = roi
