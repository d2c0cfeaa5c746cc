"""Plots of a case as Slicer plot nodes: convergence, volume drift and the search over twists."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import slicer

from .case_record import CaseNodes
from .node_factory import ensure, remove_role
from .tables import fill_table

BLUE, AMBER, GREEN, CRIMSON = (0.18, 0.44, 0.87), (0.78, 0.47, 0.0), (0.18, 0.61, 0.34), (0.76, 0.09, 0.24)
STEP, ALPHA, TO_CT, TO_SPLAT, DRIFT = "step", "alpha", "splat to organ (mm)", "organ to splat (mm)", "volume drift (%)"
TWIST, COST = "twist (deg)", "cost"


def write_charts(case: CaseNodes, outcome: Any) -> None:
    """Fill the plots for which the outcome has numbers and remove the others."""
    if outcome.steps:
        _convergence(case, outcome.steps)
    else:
        _drop(case, "convergence_chart", "volume_chart", "series_splat_to_ct", "series_ct_to_splat", "series_volume",
              "convergence_table")  # fmt: skip
    if outcome.twists is not None:
        _twists(case, outcome.twists)
    else:
        _drop(case, "twist_chart", "series_twist", "series_chosen_twist", "twist_table", "chosen_twist_table")


def _convergence(case: CaseNodes, steps: Sequence[dict[str, Any]]) -> None:
    table = ensure(case, "convergence_table")
    columns = {
        STEP: np.arange(1, len(steps) + 1),
        ALPHA: [step["alpha"] for step in steps],
        TO_CT: [step["trim30_splat_to_ct_mm"] for step in steps],
        TO_SPLAT: [step["trim30_ct_to_splat_mm"] for step in steps],
        DRIFT: [step["volume_drift_percent"] for step in steps],
    }
    fill_table(table, columns)
    curves = [
        _series(case, "series_splat_to_ct", "splat to organ", table, STEP, TO_CT, BLUE),
        _series(case, "series_ct_to_splat", "organ to splat (hidden side included)", table, STEP, TO_SPLAT, AMBER),
    ]
    _chart(case, "convergence_chart", "Distances that remain, nearest 70 %", "elastic step", "distance (mm)", curves)
    drift = _series(case, "series_volume", "volume drift", table, STEP, DRIFT, GREEN)
    _chart(case, "volume_chart", "Volume drift, mean det F - 1", "elastic step", "volume drift (%)", [drift])


def _twists(case: CaseNodes, twists: dict[str, Any]) -> None:
    degrees, costs = np.asarray(twists["twists_deg"], dtype=float), np.asarray(twists["costs"], dtype=float)
    order, chosen = np.argsort(degrees), int(np.argmin(np.abs(degrees - float(twists["chosen_deg"]))))
    table, marked = ensure(case, "twist_table"), ensure(case, "chosen_twist_table")
    fill_table(table, {TWIST: degrees[order], COST: costs[order]})
    twice = [chosen, chosen]  # VTK does not draw a series of a single point
    fill_table(marked, {TWIST: degrees[twice], COST: costs[twice]})
    name = f"chosen: {degrees[chosen]:.0f} deg"
    series = [
        _series(case, "series_twist", "every twist", table, TWIST, COST, BLUE),
        _series(case, "series_chosen_twist", name, marked, TWIST, COST, CRIMSON, marker_size=14),
    ]
    title = "Search over twists about the viewing axis"
    _chart(case, "twist_chart", title, "twist (deg)", str(twists["cost_name"]), series)


def _series(
    case: CaseNodes, role: str, name: str, table: Any, x: str, y: str, colour: Sequence[float], *, marker_size: int = 7
) -> Any:
    node = ensure(case, role)
    node.SetName(name)
    node.SetAndObserveTableNodeID(table.GetID())
    node.SetXColumnName(x)
    node.SetYColumnName(y)
    node.SetPlotType(slicer.vtkMRMLPlotSeriesNode.PlotTypeScatter)
    node.SetLineStyle(slicer.vtkMRMLPlotSeriesNode.LineStyleSolid)
    node.SetMarkerStyle(slicer.vtkMRMLPlotSeriesNode.MarkerStyleCircle)
    node.SetMarkerSize(marker_size)
    node.SetLineWidth(2)
    node.SetColor(*colour)
    return node


def _chart(case: CaseNodes, role: str, title: str, x: str, y: str, series: Sequence[Any]) -> None:
    node = ensure(case, role)
    node.SetTitle(title)
    node.SetXAxisTitle(x)
    node.SetYAxisTitle(y)
    node.SetLegendVisibility(len(series) > 1)
    wanted = [one.GetID() for one in series]
    shown = [node.GetNthPlotSeriesNodeID(k) for k in range(node.GetNumberOfPlotSeriesNodes())]
    if shown != wanted:
        node.RemoveAllPlotSeriesNodeIDs()
        for identifier in wanted:
            node.AddAndObservePlotSeriesNodeID(identifier)


def _drop(case: CaseNodes, *roles: str) -> None:
    for role in roles:
        remove_role(case, role)
