"""Section 1, second part: the length of one scene unit of the splat."""

from __future__ import annotations

from typing import Any

from organphys.ground.checks import InputError

from ..choices import UnitChoice
from ..inputs.organ_surface import organ_surface
from ..inputs.segment_checks import is_empty
from ..inputs.splat_node import is_splat
from ..inputs.splat_scale import forget_unit, guess_scale, mm_per_unit_of, set_scale
from ..outputs.case_nodes import case_of
from ..outputs.follow_splat import results_follow
from ..parameters import LARGEST_UNIT_MM, LEAST_UNIT_MM, stated_mm_per_unit
from .section import Section, guarded


class UnitSection(Section):
    """Shows the fields that matter for the chosen unit; a unit that is stated, or not any more, moves the splat to that
    scale and its results with it."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        self._splat_id = ""
        self._stated: tuple[float | None, float] = (None, 0.0)

    def refresh(self) -> None:
        parameters, ui = self.panel.parameters, self.ui
        known = parameters.unitChoice is not UnitChoice.Unknown
        ui.mmPerUnitSpinBox.visible = parameters.unitChoice is UnitChoice.Custom
        ui.percentLabel.visible = ui.unitPercentSpinBox.visible = known
        self._follow()

    @guarded
    def _follow(self) -> None:
        parameters = self.panel.parameters
        splat = parameters.splat
        splat_id = splat.GetID() if is_splat(splat) else ""
        if splat_id != self._splat_id:
            self._splat_id = splat_id
            self._take_from_splat()
        stated = (stated_mm_per_unit(parameters), parameters.unitPercent)
        if stated == self._stated:
            return
        self._stated = stated
        if splat_id:
            self._show_unit(splat, *stated)

    def _show_unit(self, splat: Any, mm_per_unit: float | None, percent: float) -> None:
        if mm_per_unit is not None:
            set_scale(splat, mm_per_unit, "stated", percent=percent)
        elif mm_per_unit_of(splat)[1] == "stated":
            self._show_without_unit(splat)
        results_follow(splat)

    def _show_without_unit(self, splat: Any) -> None:
        """At the scale that a registration has found, else at about the organ's size."""
        chosen = self.panel.parameters
        case = self.panel.case() or case_of(chosen.segmentation, chosen.segmentID, splat)
        if case is not None and case.splat is splat:
            set_scale(splat, case.record["mm_per_unit"], "registered")
            return
        forget_unit(splat)
        if not is_empty(chosen.segmentation, chosen.segmentID):
            guess_scale(splat, organ_surface(chosen.segmentation, chosen.segmentID))

    def _take_from_splat(self) -> None:
        """A splat that was loaded with its unit brings it along."""
        parameters = self.panel.parameters
        splat = parameters.splat
        if not is_splat(splat):
            return
        mm_per_unit, kind, percent = mm_per_unit_of(splat)
        if kind != "stated":
            return
        if parameters.unitChoice is UnitChoice.Unknown:
            if not LEAST_UNIT_MM <= mm_per_unit <= LARGEST_UNIT_MM:
                text = f"the splat was loaded with {mm_per_unit:g} mm per scene unit, which cannot be right: "
                raise InputError(text + "state its unit")
            self.panel.choose({"mmPerUnit": mm_per_unit, "unitPercent": percent, "unitChoice": UnitChoice.Custom})
        self._stated = (stated_mm_per_unit(parameters), parameters.unitPercent)
