"""Section 3: starting, watching, cancelling and undoing a run."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from slicer.i18n import tr as _

from ..dependencies import missing_packages
from .message_box import show_message
from .section import Section, guarded

ALL_STAGES = ("coarse", "rigid", "elastic")


class RegisterSection(Section):
    """Register becomes Cancel while a run lasts. Why a run is not possible is told below the button."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        self.run: Any = None
        self._warm = False
        self._began = 0.0
        ui.applyButton.connect("clicked()", self.apply)
        self._steps = {"coarse": ui.coarseButton, "rigid": ui.rigidButton, "elastic": ui.elasticButton}
        ui.coarseButton.connect("clicked()", lambda: self.start(("coarse",)))
        ui.rigidButton.connect("clicked()", lambda: self.start(("rigid",)))
        ui.elasticButton.connect("clicked()", lambda: self.start(("elastic",)))
        ui.undoButton.connect("clicked()", self.undo)

    @property
    def running(self) -> bool:
        """Whether a run lasts, its transform grids included."""
        return self.run is not None and not self.run.finished

    def refresh(self) -> None:
        running, ui = self.running, self.ui
        cancelling = running and self.run.state == "cancelling"
        reasons = [] if running else self.panel.logic.problems(self.panel.parameters)
        ui.applyButton.text = _("Cancel") if running else _("Register")
        ui.applyButton.enabled = not cancelling and not reasons
        tip = _("Stop the run; the scene is restored.") if running else _("Coarse, rigid and elastic in one run.")
        ui.applyButton.toolTip = "\n".join(reasons) or tip
        stranger = self.panel.logic.organphysInUse().warning
        if reasons or not stranger:
            show_message(ui.reasonLabel, reasons[:1], "info")
        else:
            show_message(ui.reasonLabel, stranger, "warning")
        self._warm_up(not running and not reasons)
        ui.progressBar.visible = running
        for content in (ui.inputsContent, ui.displayContent, ui.sampleDataButton):
            content.enabled = not running
        for button in self._steps.values():
            button.enabled = not running and not reasons
        ui.undoButton.enabled = not running and self.panel.logic.canUndo()

    @guarded
    def apply(self) -> None:
        """Start a run of all stages, or cancel the one that lasts."""
        if self.running:
            self.run.cancel()
            self.panel.refresh()
        else:
            self.start(ALL_STAGES)

    @guarded
    def start(self, stages: Sequence[str], start: Any = None) -> None:
        """Start a run. ``start`` (4, 4): T_scene_ct set by hand, the first of ``stages`` begins there."""
        self.panel.tell("")
        self.ui.showWeightsButton.checked = False  # they would hide the overlay
        started = self.panel.logic.startRun(
            self.panel.parameters,
            stages,
            start=start,
            onProgress=self._progress,
            onDone=self._done,
            onTransform=self._transform_done,
            onFailed=self._failed,
        )
        if started is not None:  # else the reason is told
            self.run, self._began = started, time.monotonic()
            self._progress("prepare", 0.0)
        self.panel.refresh()

    @guarded
    def undo(self) -> None:
        """Take the last run back."""
        self.panel.logic.undo()
        self.panel.adopt_chosen()  # the run may have been another organ's
        self.panel.tell(_("The last run was taken back."))
        self.panel.refresh()

    def _warm_up(self, ready: bool) -> None:
        """Start the registration process once the inputs are there: the first run is shorter then."""
        if ready and not self._warm and not missing_packages():
            self._warm = True
            self.panel.logic.warmUp()

    def _progress(self, stage: str, fraction: float) -> None:
        percent = round(100 * fraction)
        self.ui.progressBar.value = percent
        self.ui.progressBar.format = f"{_stage_name(stage)} – {percent} %"

    def _done(self, case: Any) -> None:
        if self.panel.parameters is not None:
            self.panel.adopt(case)
        self._tell_outcome(case)
        self.ui.progressBar.format = _("Sampling the transform CT to scene")
        self.panel.refresh_soon()

    def _transform_done(self, case: Any) -> None:
        self.panel.refresh_soon()

    def _failed(self, code: str, message: str) -> None:
        self.panel.tell(message, "info" if code == "cancelled" else "error")
        self.panel.refresh()

    def _tell_outcome(self, case: Any) -> None:
        """The run's warnings in plain words, or that there are none."""
        if not self.panel.tell_warnings(case):
            seconds = time.monotonic() - self._began
            self.panel.tell(_("Done in {seconds:.1f} s, without warnings.").format(seconds=seconds), "good")


def _stage_name(stage: str) -> str:
    names = {
        "prepare": _("Reading the inputs"),
        "load": _("Preparing organ and splat"),
        "read": _("Preparing organ and splat"),
        "clean splat": _("Removing floaters"),
        "coarse": _("Coarse"),
        "basis": _("Elastic basis"),
        "rigid": _("Rigid"),
        "elastic": _("Elastic"),
        "grids": _("Transform"),
        "results": _("Results"),
    }
    return names.get(stage, stage.capitalize())
