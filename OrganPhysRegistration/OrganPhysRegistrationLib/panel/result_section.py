"""Section 4, first part: which stage is shown, and the figures that say how far to trust it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import qt
from slicer.i18n import tr as _

from ..choices import Stage
from .choice_buttons import ChoiceButtons
from .message_box import show_message
from .section import Section, guarded
from .show_nodes import show_chart, show_table

CHARTS = {"convergence_chart": "Convergence", "volume_chart": "Volume drift", "twist_chart": "Pose search"}


class ResultSection(Section):
    """Stage switch, key figures, metrics table and plots of the present case."""

    def __init__(self, panel: Any) -> None:
        super().__init__(panel)
        ui = self.ui
        buttons = {
            Stage.Before: ui.stageBeforeButton,
            Stage.Coarse: ui.stageCoarseButton,
            Stage.Rigid: ui.stageRigidButton,
            Stage.Elastic: ui.stageElasticButton,
        }
        self._stages = ChoiceButtons(buttons, self.show_stage)
        ui.metricsTableButton.connect("clicked()", self.show_table)
        self._menu = qt.QMenu(ui.plotsButton)
        ui.plotsButton.setMenu(self._menu)
        self._menu.connect("aboutToShow()", self._fill_menu)
        self._case_id = ""
        self._coloured: tuple[Any, ...] = ()

    def refresh(self) -> None:
        case, ui = self.panel.case(), self.ui
        stages = case.stages if case is not None else []
        self._stages.show(self.panel.parameters.shownStage, {stage: stage.value in stages for stage in Stage})
        for name, text in key_figures(case, self.panel.parameters.shownStage.value).items():
            getattr(ui, f"{name}ValueLabel").text = text
        self._show_verdict(case)
        self._show_colours(case)
        ui.metricsTableButton.enabled = case is not None and case.get("metrics") is not None
        ui.plotsButton.enabled = case is not None
        case_id = case.case_id if case is not None else ""
        if case_id != self._case_id:
            self._case_id = case_id
            ui.resultButton.collapsed = not case_id

    @guarded
    def show_stage(self, stage: Stage) -> None:
        """Show the organ after one stage."""
        from ..outputs.stage_switch import show_stage

        case = self.panel.case()
        if case is not None:
            show_stage(case, stage.value)
            self.panel.parameters.shownStage = stage
        self.panel.refresh()

    @guarded
    def _show_colours(self, case: Any) -> None:
        """Colour the elastic surface as chosen; a case without such figures shows the distance."""
        from ..outputs.surface_colours import DISTANCE, colour_surfaces, possible_colours

        possible = [] if case is None else possible_colours(case)
        self.ui.surfaceColourCombo.enabled = bool(possible)
        if possible:
            chosen = self.panel.parameters.surfaceColour.value
            wanted = (case.case_id, case.node("surface_elastic").GetMesh(), chosen if chosen in possible else DISTANCE)
            if wanted != self._coloured:
                colour_surfaces(case, wanted[2])
                self._coloured = wanted

    def _show_verdict(self, case: Any) -> None:
        """Whether to trust the result and why, above everything else about it."""
        verdict = None if case is None else case.record.get("verdict")
        lines = [] if not verdict else [verdict["headline"], *(reason["message"] for reason in verdict["reasons"])]
        kind = {"trust": "good", "check": "warning"}.get(verdict["level"], "error") if verdict else "plain"
        show_message(self.ui.verdictLabel, lines if len(lines) > 1 else "".join(lines), kind)

    @guarded
    def show_table(self) -> None:
        """The metrics table in a layout with a table view."""
        show_table(self.panel.case().node("metrics"))

    @guarded
    def show_chart(self, role: str) -> None:
        """A plot of the case in a layout with a plot view."""
        show_chart(self.panel.case().node(role))

    def _fill_menu(self) -> None:
        self._menu.clear()
        case = self.panel.case()
        for role, title in CHARTS.items():
            if case is not None and case.get(role) is not None:
                action = self._menu.addAction(_(title))
                action.connect("triggered()", lambda role=role: self.show_chart(role))


def key_figures(case: Any, stage: str) -> dict[str, str]:
    """Figure -> value with its unit; a dash where the stage has none."""
    figures = dict.fromkeys(("distance", "scale", "volume", "detF", "error", "seconds"), "–")
    if case is None:
        return figures
    record = case.record
    metrics: Mapping[str, Mapping[str, Any]] = record["metrics"].get(stage, {})
    sources = {
        "distance": "trim30_splat_to_ct",
        "volume": "volume_drift",
        "detF": "min_det_F",
        "error": "error_95_hidden",
    }
    for name, metric in sources.items():
        if metric in metrics and math.isfinite(metrics[metric]["value"]):
            figures[name] = _with_unit(metrics[metric]["value"], metrics[metric]["unit"])
    figures["scale"] = f"{record['mm_per_unit']:.4g} " + _("mm per scene unit")
    figures["seconds"] = f"{sum(record['seconds'].values()):.1f} s"
    return figures


def _with_unit(value: float, unit: str) -> str:
    if unit == "%":
        return f"{value:+.2f} %"
    return f"{value:.2f}" if unit in ("1", "") else f"{value:.2f} {unit}"
