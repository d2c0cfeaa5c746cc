"""Curves and bars of the report as SVG text, drawn with matplotlib's object interface (no global state, no window)."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..ground.checks import Array
from .report_content import CoarseFigures, StepFigures

BLUE, AMBER, GREEN, CRIMSON, GREY = "#2f6fde", "#c77700", "#2e9b57", "#c2183c", "#b8bfca"


def convergence_plot(steps: Sequence[StepFigures]) -> str:
    """Trimmed splat-to-CT distance (mm) and volume drift (percent) against the elastic step (the paper's Figure 8)."""
    figure, (top, bottom) = _figure(9.4, 4.6, rows=2)
    count = np.arange(1, len(steps) + 1)
    distances = np.array([s.trim30_splat_to_ct_mm for s in steps])
    top.plot(count, distances, color=BLUE, marker=".")
    if np.nanmin(distances) < 0.5 * np.nanmax(distances):
        top.set_ylim(bottom=0)
    top.set_ylabel("splat to CT,\nclosest 70 %, mm")
    bottom.axhline(0, color=GREY, lw=1)
    bottom.plot(count, [s.volume_drift_percent for s in steps], color=BLUE, marker=".")
    bottom.set_ylabel("volume drift, %")
    bottom.set_xlabel("elastic step")
    _mark_alphas((top, bottom), [s.alpha for s in steps])
    return _svg(figure)


def histogram_plot(splat_to_ct_mm: Array | None, ct_visible_to_splat_mm: Array | None) -> str:
    """Share of points (percent) over the distance that remains, in mm."""
    figure, (axes,) = _figure(9.4, 2.9)
    named = (("splat to CT", splat_to_ct_mm, BLUE), ("visible CT to splat", ct_visible_to_splat_mm, AMBER))
    sets = [(name, d[np.isfinite(d)], colour) for name, d, colour in named if d is not None]
    sets = [entry for entry in sets if len(entry[1])]
    end = max((float(np.percentile(d, 98)) for _, d, _ in sets), default=1.0) * 1.15 + 1e-9
    bins = np.linspace(0, end, 41)
    for name, d, colour in sets:
        share = np.full(len(d), 100 / len(d))
        words = f"{name}: median {np.median(d):.2f} mm, 95 % below {np.percentile(d, 95):.1f} mm"
        axes.hist(np.minimum(d, end), bins=bins, weights=share, histtype="stepfilled", color=colour, alpha=0.3)
        axes.hist(np.minimum(d, end), bins=bins, weights=share, histtype="step", color=colour, lw=1.6, label=words)
    axes.set_xlim(0, end)
    axes.set_xlabel("distance, mm (the last bar holds all beyond)")
    axes.set_ylabel("share of points, %")
    axes.legend(loc="upper right", frameon=False)
    return _svg(figure)


def twist_plot(coarse: CoarseFigures) -> str:
    """Cost of every twist tried; the chosen one green, the worst crimson (the paper's Figure 6)."""
    figure, (axes,) = _figure(9.4, 2.7)
    degrees, costs = np.asarray(coarse.twists_deg, dtype=float), np.asarray(coarse.twist_costs, dtype=float)
    order = np.argsort(degrees)
    degrees, costs = degrees[order], costs[order]
    turn = np.abs((degrees - coarse.chosen_twist_deg + 180) % 360 - 180)
    colours = np.full(len(costs), "#9aa9c4", dtype=object)
    if len(costs):
        colours[np.nanargmax(costs)] = CRIMSON
        colours[turn.argmin()] = GREEN
    axes.bar(np.arange(len(costs)), costs, color=list(colours), width=0.72)
    axes.set_xticks(np.arange(len(costs)), [f"{d:.0f}°" for d in degrees])
    axes.set_ylabel(coarse.twist_cost_name.replace(", ", ",\n", 1))
    axes.set_xlabel("twist about the viewing axis: chosen green, worst crimson")
    return _svg(figure)


def _mark_alphas(plots: Sequence[Any], alphas: Sequence[float]) -> None:
    """A dotted line wherever alpha changes, and its value at the top."""
    starts = [k for k in range(len(alphas)) if k == 0 or alphas[k] != alphas[k - 1]]
    for k in starts:
        for axes in plots:
            if k:
                axes.axvline(k + 0.5, color=GREY, ls=":", lw=1.2)
        place = plots[0].get_xaxis_transform()
        plots[0].text(k + 0.65, 1.02, f"α = {alphas[k]:.2g}", transform=place, fontsize=9, color="#5b6472")


def _figure(width: float, height: float, *, rows: int = 1) -> tuple[Any, list[Any]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    plots = [figure.add_subplot(rows, 1, k + 1) for k in range(rows)]
    for axes in plots:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(axis="y", color="#e6e9ee", lw=0.8)
        axes.set_axisbelow(True)
    return figure, plots


def _svg(figure: Any) -> str:
    from matplotlib import rc_context
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    stream = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "organphys"}):
        FigureCanvasSVG(figure).print_svg(stream, metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    return re.sub(r' id="[a-zA-Z0-9.]+_\d+"', "", text[text.index("<svg") :])  # names that another plot has too
