"""Section 1, second part: the length of one scene unit of the splat."""

from __future__ import annotations

from typing import Any

from ..choices import UnitChoice
from ..parameters import stated_mm_per_unit
from .section import Section, guarded


class UnitSection(Section):
    """Shows the fields that matter for the chosen unit; a unit stated by the user moves the splat to that scale."""

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
        splat_id = parameters.splat.GetID() if parameters.splat is not None else ""
        if splat_id != self._splat_id:
            self._splat_id = splat_id
            self._take_from_splat()
        stated = (stated_mm_per_unit(parameters), parameters.unitPercent)
        if stated != self._stated:
            self._stated = stated
            if parameters.splat is not None and stated[0] is not None:
                from ..inputs.splat_scale import set_scale

                set_scale(parameters.splat, stated[0], "stated", percent=stated[1])

    def _take_from_splat(self) -> None:
        """A splat that was loaded with its unit brings it along."""
        parameters = self.panel.parameters
        splat = parameters.splat
        if splat is None or splat.GetAttribute("OrganPhys.MmPerUnitKind") != "stated":
            return
        if parameters.unitChoice is UnitChoice.Unknown:
            parameters.mmPerUnit = float(splat.GetAttribute("OrganPhys.MmPerUnit"))
            parameters.unitPercent = float(splat.GetAttribute("OrganPhys.MmPerUnitPercent") or 0)
            parameters.unitChoice = UnitChoice.Custom
        self._stated = (stated_mm_per_unit(parameters), parameters.unitPercent)
