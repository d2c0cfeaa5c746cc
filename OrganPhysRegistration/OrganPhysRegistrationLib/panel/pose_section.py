"""Section 3, the pose: moving the shown surface by hand between the stages."""

from __future__ import annotations

from typing import Any

from slicer.i18n import tr as _

from ..choices import Stage
from ..outputs.pose_adjustment import PoseAdjustment
from .register_section import RegisterSection
from .section import Section, guarded

NEXT_STAGES = {"before": ("rigid", "elastic"), "coarse": ("rigid", "elastic")}


class PoseSection(Section):
    """Handles on the shown surface; the next stages go on from where the user leaves it."""

    def __init__(self, panel: Any, register: RegisterSection) -> None:
        super().__init__(panel)
        self._register = register
        self._adjustment: PoseAdjustment | None = None
        self._stage: Stage | None = None
        self._frame: Any = None  # where the results stood when the adjustment began
        self.ui.adjustPoseButton.connect("toggled(bool)", self._toggle)
        self.ui.continuePoseButton.connect("clicked()", self.go_on)

    def bind(self) -> None:
        self._stop()

    def refresh(self) -> None:
        running, case = self._register.running, self.panel.case()
        moved = case is not None and self._adjustment is not None and case.record["T_overlay_scene"] != self._frame
        if running or case is None or moved or self.panel.parameters.shownStage is not self._stage:
            self._stop()
        self.ui.adjustPoseButton.enabled = case is not None and not running
        self.ui.adjustPoseButton.checked = self._adjustment is not None
        self.ui.continuePoseButton.enabled = self._adjustment is not None

    def cleanup(self) -> None:
        self._stop()
        super().cleanup()

    @guarded
    def go_on(self) -> None:
        """Register on from the pose set by hand."""
        if self._adjustment is None:
            return
        pose, stage = self._adjustment.T_scene_ct(), self.panel.parameters.shownStage.value
        self._stop()
        self._register.start(NEXT_STAGES.get(stage, ("elastic",)), pose)

    @guarded
    def _toggle(self, on: bool) -> None:
        self.panel.refresh_soon()
        if on and self._adjustment is None:
            adjustment, self._stage = PoseAdjustment(self.panel.case()), self.panel.parameters.shownStage
            adjustment.start(self._stage.value)
            self._frame = self.panel.case().record["T_overlay_scene"]
            self._adjustment = adjustment
            self.panel.tell(_("Drag the handles in the 3D view, then press Continue from this pose."))
        elif not on and self._adjustment is not None:
            self._stop()
            self.panel.tell("")

    def _stop(self) -> None:
        adjustment, self._adjustment = self._adjustment, None
        if adjustment is not None:
            adjustment.stop()
        self.ui.adjustPoseButton.checked = False
