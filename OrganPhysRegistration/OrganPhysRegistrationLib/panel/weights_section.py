"""Section 1, fourth part: how far a landmark reaches, shown as colours on the organ."""

from __future__ import annotations

from typing import Any

from slicer.i18n import tr as _

from ..inputs.landmark_input import landmark_points, show_weights
from .landmark_table import placed_points
from .section import Section, guarded


class WeightsSection(Section):
    """Radius of the landmarks and the weights that follow from it."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self._shown: Any = None
        self._wanted: tuple[Any, ...] = ()
        self.ui.showWeightsButton.connect("toggled(bool)", self._toggle)

    def bind(self) -> None:
        self._hide()

    def refresh(self) -> None:
        parameters, button = self.panel.parameters, self.ui.showWeightsButton
        automatic = not parameters.landmarkRadiusMm
        self.ui.radiusSlider.suffix = " mm (" + _("auto") + ")" if automatic else " mm"
        organ = parameters.segmentation is not None and bool(parameters.segmentID)
        button.enabled = organ and bool(placed_points(parameters.landmarks))
        if not button.enabled:
            button.checked = False
        elif button.checked:
            self._show()

    def cleanup(self) -> None:
        self._hide()
        super().cleanup()

    def _toggle(self, on: bool) -> None:
        if on:
            self._show()
        else:
            self._hide()

    @guarded
    def _show(self) -> None:
        parameters = self.panel.parameters
        positions = landmark_points(parameters.landmarks)[0].tobytes()
        wanted = (parameters.segmentation, parameters.segmentID, positions, parameters.landmarkRadiusMm)
        if self._shown is None or wanted != self._wanted:
            self._wanted = wanted
            self._shown = show_weights(*wanted[:2], parameters.landmarks, parameters.landmarkRadiusMm or None)

    def _hide(self) -> None:
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.remove()
        self.ui.showWeightsButton.checked = False
