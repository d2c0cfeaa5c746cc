"""The sweeps of the full benchmark: how error and success change as one thing is made worse, as curves and tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from organphys.ground.checks import Array

from ..peers.methods import METHODS, OURS
from ..runs.conditions import SWEEPS, Sweep
from .plots import COLOURS, plain_numbers
from .run_set import SUCCESS, Run, RunSet, number
from .sweep_notes import not_ahead, told
from .sweep_ratios import complete_ratios
from .table import Table

ENDLESS = 1e9  # in place of infinity, which percentiles cannot interpolate


@dataclass(frozen=True)
class Curves:
    """One sweep: ``cases`` and ``ratios`` as of ``complete_ratios``; ``runs``: all of it."""

    sweep: Sweep
    cases: tuple[str, ...]
    ratios: dict[str, dict[float, Array]]
    runs: Sequence[Run]

    @property
    def levels(self) -> list[float]:
        return list(next(iter(self.ratios.values())))

    @property
    def table(self) -> Table:
        """A row per method: at every level the median ratio and the share that succeeds."""
        head = ("method", "runs a level", *(f"{level:g}" for level in self.levels))
        rows = tuple(
            (METHODS[method].title, _count(list(by_level.values())), *(_cell(values) for values in by_level.values()))
            for method, by_level in self.ratios.items()
        )
        return Table(
            f"Sweep: {self.sweep.name}", head, rows,
            f"Columns: {self.sweep.label}. Median of the TRE over that of the best similarity / success, % of the runs "
            f"with at most {SUCCESS:g}. Runs: of {', '.join(self.cases)}, the same for every method, commit "
            f"{', '.join(sorted({run['commit'] for run in self.runs}))}; slow methods run fewer seeds. "
            f"{not_ahead(self.ratios, self.runs)} {told(self.runs)} {self.sweep.note}".rstrip(),
        )  # fmt: skip

    @property
    def plot(self) -> Figure:
        """Median ratio with the quartiles, and the share of registrations that succeed; in brackets runs a level."""
        figure, (left, right) = plt.subplots(1, 2, figsize=(11, 3.9), layout="constrained")
        for method, by_level in self.ratios.items():
            values = list(by_level.values())
            low, middle, high = np.array([quartiles(v) for v in values]).T
            succeeded = [100 * np.mean(v <= SUCCESS) for v in values]
            style = {"color": COLOURS[method], "linewidth": 2.4 if method in OURS else 1.3, "marker": "o"}
            left.plot(self.levels, middle, markersize=3.5, label=f"{METHODS[method].title} ({_count(values)})", **style)
            left.fill_between(self.levels, low, high, color=COLOURS[method], alpha=0.12, linewidth=0)
            right.plot(self.levels, succeeded, markersize=3.5, **style)
        left.set(xlabel=self.sweep.label, ylabel="TRE / best similarity's, median, quartiles", yscale="log")
        plain_numbers(left.yaxis)
        right.set(xlabel=self.sweep.label, ylabel=f"ratio at most {SUCCESS:g}, % of runs", ylim=(-3, 103))
        for axes in (left, right):
            axes.grid(which="both", alpha=0.25)
            axes.xaxis.label.set_fontsize(9)
            axes.set_xticks(self.levels, [f"{level:g}" for level in self.levels])
        figure.legend(*left.get_legend_handles_labels(), fontsize=8, loc="outside right center", frameon=False)
        return figure


def quartiles(values: Array) -> Array:
    """Lower quartile, median and upper quartile; infinite where values that they lie between are."""
    found = np.percentile(np.minimum(values, ENDLESS), (25, 50, 75))
    return np.where(found < ENDLESS / 1e3, found, np.inf)


def sweep_curves(runs: RunSet) -> list[Curves]:
    """Those sweeps that have run at two levels at least."""
    swept = {name: [run for run in runs.runs if run["condition"]["sweep"] == name] for name in SWEEPS}
    found = [Curves(SWEEPS[name], *complete_ratios(runs, SWEEPS[name]), of_sweep) for name, of_sweep in swept.items()]
    return [curves for curves in found if curves.ratios and len(curves.levels) > 1]


def _count(levels: Sequence[Array]) -> str:
    """How many runs the levels have."""
    counts = sorted({len(values) for values in levels})
    return " or ".join(str(count) for count in counts)


def _cell(values: Array) -> str:
    return f"{number(quartiles(values)[1])} / {100 * np.mean(values <= SUCCESS):.0f} %"
