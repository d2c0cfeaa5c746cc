"""Section 3, second line: stiffness by slider, and live update."""

from __future__ import annotations

from typing import Any

from slicer.i18n import tr as _

from ..choices import Method, Stiffness
from ..runs.live_updates import PLACES
from ..runs.run_inputs import inputs_from_parameters
from ..stiffness_scale import percent_of
from .section import Section, guarded


class LiveSection(Section):
    """A preset moves the slider; a moved slider is a choice of its own. ``live``: the updates while they are on."""

    def __init__(self, panel: Any, register: Any) -> None:
        super().__init__(panel)
        self.live: Any = None
        self._register = register
        self._seen: tuple[Stiffness, float] | None = None
        self.ui.liveCheckBox.connect("toggled(bool)", self.switch)

    def bind(self) -> None:
        self._seen = None
        self._end()

    def refresh(self) -> None:
        self._follow_choices()
        parameters, ui = self.panel.parameters, self.ui
        ours = parameters.method is Method.OrganPhys
        ui.stiffnessSlider.enabled = ours and not self._register.running
        ui.liveCheckBox.enabled = self.live is not None or (
            ours and not self._register.running and self.panel.case() is not None
        )
        if self.live is not None and self.live.inputs.splat_landmarks is not parameters.splatLandmarks:
            self.live.stop(PLACES)
        if self.live is not None:
            self.live.set_stiffness_if_new(inputs_from_parameters(parameters).stiffness)

    @guarded
    def switch(self) -> None:
        """The check box was clicked, or set."""
        wanted = bool(self.ui.liveCheckBox.checked)
        if wanted == (self.live is not None):
            return
        if not wanted:
            self._end()
            return
        self.ui.liveCheckBox.checked = False  # until it has begun
        self.live = self.panel.logic.startLiveUpdate(
            self.panel.parameters,
            onUpdated=self._updated,
            onSettled=self._settled,
            onFailed=lambda message: self.panel.tell(message, "warning"),
            onEnded=self._ended,
        )
        self.ui.liveCheckBox.checked = True
        self.panel.tell(_("Live update is on: move a landmark or the stiffness."))
        self.panel.refresh_soon()

    def cleanup(self) -> None:
        self._end()
        super().cleanup()

    def _end(self) -> None:
        if self.live is not None:
            self.panel.logic.stopLiveUpdate()

    def _updated(self, case: Any, seconds: float) -> None:
        text = _("Registered again in {seconds:.1f} s; the transforms follow when you stop.")
        self.panel.tell(text.format(seconds=seconds))
        self.panel.refresh_soon()

    def _settled(self, case: Any) -> None:
        if not self.panel.tell_warnings(case):
            self.panel.tell(_("Surface, transforms and figures are up to date."), "good")
        self.panel.refresh_soon()

    def _ended(self, message: str) -> None:
        self.live = None
        self.ui.liveCheckBox.checked = False
        if message:
            self.panel.tell(message, "warning")
        self.panel.refresh_soon()

    def _follow_choices(self) -> None:
        """Whichever of preset and slider the user has changed leads the other."""
        parameters = self.panel.parameters
        if parameters.method is Method.Paper and parameters.stiffness is Stiffness.Custom:
            parameters.stiffness = Stiffness.Moderate  # it takes presets only
        chosen, percent = parameters.stiffness, parameters.stiffnessPercent
        before = self._seen
        if chosen is not Stiffness.Custom and percent != percent_of(chosen.value):
            if before is not None and before[1] != percent and before[0] is chosen:
                parameters.stiffness = Stiffness.Custom
            else:
                parameters.stiffnessPercent = percent_of(chosen.value)
        self._seen = (parameters.stiffness, parameters.stiffnessPercent)
