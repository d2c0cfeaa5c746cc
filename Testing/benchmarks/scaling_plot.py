"""Log-log plots of the scaling runs, and the exponents they show."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

LEAST_S = 0.05  # of processor time: below it the fixed part and the clock decide
FOLLOWING = (  # a registration
    "displacement grids",
    "read all of the splat",
    "simulated body",
    "bind splat",
    "move and write splat",
)
NAMES = {
    "voxels": "voxels of the label map",
    "gaussians": "Gaussians",
    "surface": "surface samples",
    "handles": "handles",
    "quadrature": "quadrature points",
}


def exponents(rows: Sequence[dict], least_s: float = LEAST_S) -> dict[str, float | None]:
    """Slope of log seconds over log size, fitted to the three largest sizes of a stage; None where it is too quick."""
    found: dict[str, float | None] = {}
    for name in dict.fromkeys(stage for row in rows for stage in row["stages"]):
        has = [(row["value"], row["stages"][name]["processor_s"]) for row in rows[-3:] if name in row["stages"]]
        size, seconds = np.array(has, dtype=float).T
        slow = len(has) > 1 and seconds[-1] >= least_s and seconds.min() > 0
        found[name] = float(np.polyfit(np.log(size), np.log(seconds), 1)[0]) if slow else None
    return found


def peak_memory(rows: Sequence[dict], follows: bool) -> list[float]:
    """MB of every row, of the registration or of what follows it; 0 where that was not run or not known."""
    return [
        max(
            (stage["peak_mb"] or 0.0 for name, stage in row["stages"].items() if (name in FOLLOWING) == follows),
            default=0.0,
        )
        for row in rows
    ]


def scaling_plot(path: Path, records: Sequence[dict]) -> None:
    """PNG: a panel an axis with the processor time of its stages, and one of the memory of whole registrations."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 7.4), dpi=80, layout="constrained")
    for number, (axis, name) in enumerate(NAMES.items()):
        rows = sorted((r for r in records if r["axis"] == axis), key=lambda r: r["value"])
        if rows:
            _seconds(figure.add_subplot(2, 3, number + 1), rows, name)
    _memory(figure.add_subplot(2, 3, 6), records)
    FigureCanvasAgg(figure).print_png(str(path))


def _seconds(axes, rows: Sequence[dict], name: str) -> None:
    slopes = exponents(rows)
    slowest = sorted(slopes, key=lambda s: -rows[-1]["stages"].get(s, {"processor_s": 0})["processor_s"])[:9]
    for number, stage in enumerate(slowest):
        has = [(row["value"], row["stages"][stage]["processor_s"]) for row in rows if stage in row["stages"]]
        slope = "" if slopes[stage] is None else f" ({round(slopes[stage], 1) + 0.0:.1f})"
        axes.plot(*zip(*has, strict=True), "o-", ms=3, lw=1.2, color=f"C{number}", label=stage + slope)
    sizes = np.array([rows[0]["value"], rows[-1]["value"]], dtype=float)
    top = max(row["stages"][s]["processor_s"] for row in rows[-1:] for s in slowest if s in row["stages"])
    axes.plot(sizes, 1.6 * top * sizes / sizes[-1], color="#9aa3b2", lw=1, ls="--", label="linear")
    axes.set(xscale="log", yscale="log", xlabel=name, ylabel="processor seconds", ylim=(1e-2, 30 * top))
    if sizes[1] < 100 * sizes[0]:
        _plain_ticks(axes.xaxis, [row["value"] for row in rows])
    axes.legend(frameon=False, fontsize=6, loc="upper left", ncols=2, columnspacing=1)
    axes.grid(alpha=0.2)


def _memory(axes, records: Sequence[dict]) -> None:
    lines = (
        ("voxels", False, "registered"),
        ("gaussians", False, "registered"),
        ("gaussians", True, "moved and written"),
    )
    for axis, follows, what in lines:
        rows = sorted((r for r in records if r["axis"] == axis), key=lambda r: r["value"])
        peaks = peak_memory(rows, follows)
        if any(peaks):
            axes.plot([row["value"] for row in rows], peaks, "o-", ms=3, label=f"{NAMES[axis]}, {what}")
    axes.axhline(4096, color="#c2261d", lw=1, ls="--", label="4 GB")
    axes.set(xscale="log", yscale="log", xlabel="size", ylabel="peak memory, MB", ylim=(200, 20_000))
    _plain_ticks(axes.yaxis, [250, 500, 1000, 2000, 4000])
    axes.legend(frameon=False, fontsize=7, loc="upper left")
    axes.grid(alpha=0.2)


def _plain_ticks(axis, places: Sequence[float]) -> None:
    from matplotlib.ticker import NullFormatter

    axis.set_ticks(places, labels=[f"{place:g}" for place in places])
    axis.set_minor_formatter(NullFormatter())
