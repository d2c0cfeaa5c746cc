"""Reliability plot: promised against observed share of errors within their radius."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

REGIONS = (("visible", "#2f6fde"), ("hidden", "#c2261d"), ("interior", "#2e9b57"))


def reliability_plot(path: Path, levels: Sequence[float], held_out: np.ndarray, cases: np.ndarray) -> None:
    """PNG of the pooled curve of every region with those of the single cases, all left out of their fit.

    held_out (runs, 3, levels): share of the errors within the radius; cases (runs,): names.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 3.8), layout="constrained")
    for number, (name, colour) in enumerate(REGIONS):
        axes = figure.add_subplot(1, 3, number + 1)
        axes.plot([0, 1], [0, 1], color="#9aa3b2", lw=1)
        axes.fill_between([0.66, 0.70], 0.60, 0.76, color="#f3d9a4", lw=0, label="wanted, pooled")
        axes.fill_between([0.93, 0.97], 0.90, 0.98, color="#f3d9a4", lw=0)
        for case in sorted(set(cases)):
            axes.plot(levels, held_out[cases == case, number].mean(axis=0), color=colour, lw=0.8, alpha=0.35)
        axes.plot(levels, held_out[:, number].mean(axis=0), "o-", color=colour, lw=2, ms=4, label="pooled")
        axes.plot([], [], color=colour, lw=0.8, alpha=0.35, label="single cases")
        axes.set(title=name, xlim=(0, 1), ylim=(0, 1), aspect="equal", xlabel="promised probability")
        axes.spines[["top", "right"]].set_visible(False)
        if number == 0:
            axes.set_ylabel("share within the radius")
            axes.legend(frameon=False, loc="upper left", fontsize=9)
    FigureCanvasAgg(figure).print_png(str(path))
