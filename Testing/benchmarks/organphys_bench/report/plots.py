"""The plots of the report, as matplotlib figures."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from ..peers.methods import METHODS
from .paper_tables import ALPHAS
from .run_set import RunSet, mean_tre, ratio

COLOURS = dict(zip(METHODS, plt.get_cmap("tab20").colors[::2] + plt.get_cmap("tab20").colors[1::2], strict=False))
COLOURS |= {"organphys": (0.0, 0.25, 0.65), "organphys_no_landmarks": (0.30, 0.65, 1.0)}


def ratio_plot(runs: RunSet) -> Figure:
    """TRE over that of the best similarity, one mark per case and method, log scale."""
    figure, axes = plt.subplots(figsize=(9.5, 0.42 * len(runs.methods) + 1.4), layout="constrained")
    marks = "osD^vP*Xhd<>"
    for k, case in enumerate(runs.cases):
        values = [runs.value(case, method, ratio) for method in runs.methods]
        axes.scatter(values, range(len(values)), marker=marks[k % len(marks)], s=34, label=case, alpha=0.85)
    means = [runs.values(method, ratio).mean() for method in runs.methods]
    axes.scatter(means, range(len(means)), marker="|", s=420, color="black", linewidths=2.2)
    axes.plot([], [], "|", color="black", markersize=9, markeredgewidth=2.2, label="mean over cases")
    axes.axvline(1, color="grey", linewidth=1, linestyle="--")
    axes.set(xscale="log", xlabel="mean TRE / mean TRE of the best similarity (dashed: 1)")
    axes.set_ylim(-0.6, len(runs.methods) - 0.4)
    plain_numbers(axes.xaxis)
    axes.set_yticks(range(len(runs.methods)), [METHODS[method].title for method in runs.methods])
    axes.invert_yaxis()
    axes.grid(axis="x", which="both", alpha=0.25)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    return figure


def time_plot(runs: RunSet) -> Figure:
    """Mean TRE against mean processor seconds, both over the cases."""
    figure, axes = plt.subplots(figsize=(7.5, 4.6), layout="constrained")
    for method in runs.methods:
        done = [run for case in runs.cases if (run := runs.baseline.get((case, method))) and not run["failure"]]
        if done:
            seconds = np.mean([run["seconds"]["total"]["processor_s"] for run in done])
            tre = runs.values(method, mean_tre).mean()
            axes.scatter(seconds, tre, s=60, color=COLOURS[method], label=METHODS[method].title)
    axes.set(xscale="log", yscale="log", xlabel="processor seconds, mean over the cases", ylabel="mean TRE, mm")
    plain_numbers(axes.xaxis)
    plain_numbers(axes.yaxis)
    axes.grid(which="both", alpha=0.25)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
    return figure


def plain_numbers(axis: Axis) -> None:
    """Labels such as 0.2, 0.5, 1, 2 on a logarithmic axis."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def figure_8_plot(runs: RunSet) -> Figure | None:
    """trim30 splat to CT and volume drift over the elastic steps, a column per case."""
    cases = [case for case in runs.cases if (run := runs.baseline.get((case, "paper_figure_8"))) and not run["failure"]]
    if not cases:
        return None
    size = (2.3 * len(cases) + 0.8, 4.4)
    figure, grid = plt.subplots(2, len(cases), figsize=size, layout="constrained", squeeze=False, sharex=True)
    for k, case in enumerate(cases):
        for alpha in ALPHAS:
            steps = np.array(runs.baseline[case, "paper_figure_8"]["facts"]["figure_8"][alpha])
            for row in (0, 1):
                grid[row, k].plot(np.arange(1, len(steps) + 1), steps[:, row + 1], label=f"alpha {alpha}")
        grid[0, k].set_title(case, fontsize=9)
        grid[1, k].set_xlabel("elastic step", fontsize=8)
        for axes in grid[:, k]:
            axes.tick_params(labelsize=7)
            axes.grid(alpha=0.25)
    grid[0, 0].set_ylabel("trim30 splat to CT\n(CT box)", fontsize=8)
    grid[1, 0].set_ylabel("volume drift, %", fontsize=8)
    grid[0, 0].legend(fontsize=7)
    return figure
