"""Log-log plots of the scaling runs, and the exponents they show."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

LEAST_S = 0.05  # of processor time: below it the fixed part and the clock decide
NAMES = {
    "voxels": "voxels of the label map",
    "gaussians": "Gaussians",
    "surface": "surface samples",
    "handles": "handles",
    "quadrature": "quadrature points",
}


def exponents(rows: Sequence[dict]) -> dict[str, float | None]:
    """Slope of log seconds over log size between the two largest sizes of every stage; None where it is too quick."""
    found: dict[str, float | None] = {}
    for name in dict.fromkeys(stage for row in rows for stage in row["stages"]):
        has = [(row["value"], row["stages"][name]["processor_s"]) for row in rows if name in row["stages"]]
        (low, before), (high, after) = has[-2] if len(has) > 1 else (1, 0.0), has[-1]
        slow = after >= LEAST_S and before > 0
        found[name] = float(np.log(after / before) / np.log(high / low)) if slow else None
    return found


def scaling_plot(path: Path, records: Sequence[dict]) -> None:
    """PNG: a panel an axis with the processor time of its stages, and one of the memory of whole registrations."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 8), layout="constrained")
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
        slope = "" if slopes[stage] is None else f" ({slopes[stage]:.1f})"
        axes.plot(*zip(*has, strict=True), "o-", ms=3, lw=1.2, color=f"C{number}", label=stage + slope)
    sizes = np.array([rows[0]["value"], rows[-1]["value"]], dtype=float)
    top = max(row["stages"][s]["processor_s"] for row in rows[-1:] for s in slowest if s in row["stages"])
    axes.plot(sizes, 1.6 * top * sizes / sizes[-1], color="#9aa3b2", lw=1, ls="--", label="linear")
    axes.set(xscale="log", yscale="log", xlabel=name, ylabel="processor seconds", ylim=(5e-3, 3 * top))
    axes.legend(frameon=False, fontsize=7, loc="best")
    axes.grid(alpha=0.2)


def _memory(axes, records: Sequence[dict]) -> None:
    for axis in ("voxels", "gaussians"):
        rows = sorted((r for r in records if r["axis"] == axis), key=lambda r: r["value"])
        peaks = [max(s["peak_mb"] or 0 for s in row["stages"].values()) for row in rows]
        axes.plot([row["value"] for row in rows], peaks, "o-", ms=3, label=NAMES[axis])
    axes.axhline(4096, color="#c2261d", lw=1, ls="--", label="4 GB")
    axes.set(xscale="log", yscale="log", xlabel="size", ylabel="peak memory, MB", title="whole registration")
    axes.legend(frameon=False, fontsize=8)
    axes.grid(alpha=0.2)
