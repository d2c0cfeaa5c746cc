"""The OrganPhys paper's Table 2 and Figure 8 on our cases, its own numbers beside."""

from __future__ import annotations

from collections.abc import Sequence

from .paper_numbers import FIGURE_8_NOTE, TABLE_2, TABLE_2_NOTE, PaperRow, organ_of
from .run_set import Run, RunSet
from .table import Table

COLUMNS = (
    "organ", "of", "CT points", "splat points", "rigid s", "s per elastic step", "coarse mean / trim30",
    "rigid mean / trim30", "elastic mean / trim30", "TRE mm after rigid / elastic",
)  # fmt: skip
ALPHAS = ("0.05", "0.025", "0.005")


def paper_tables(runs: RunSet) -> list[Table]:
    """Those with rows."""
    there = {method for _, method in runs.baseline}
    tables = [table_2(runs)] if {"paper", "paper_same_start"} & there else []
    return [*tables, figure_8(runs)] if "paper_figure_8" in there else tables


def table_2(runs: RunSet) -> Table:
    """Its method on our cases, once with its own coarse alignment and once from the common start."""
    rows = []
    for case in runs.cases:
        for method, name in (("paper", case), ("paper_same_start", f"{case}, same start")):
            run = runs.baseline.get((case, method))
            if run is not None and not run["failure"]:
                start = run["figures"]["stages"]["coarse"] if method == "paper" else runs.start(case)
                rows.append((organ_of(case), name, *_measured(run, start)))
    rows += [(organ, "the paper", *_printed(row)) for organ, row in TABLE_2.items()]
    return Table("The paper's Table 2", COLUMNS, tuple(sorted(rows, key=lambda row: row[0])), TABLE_2_NOTE)


def figure_8(runs: RunSet) -> Table:
    """Where the curves of each alpha end."""
    rows = []
    for case in runs.cases:
        run = runs.baseline.get((case, "paper_figure_8"))
        if run is None or run["failure"]:
            continue
        for alpha in ALPHAS:
            steps = run["facts"]["figure_8"][alpha]
            first, last = steps[0], steps[-1]
            ends = (f"{first[1]:.4f}", f"{last[1]:.4f}", f"{last[2]:+.2f}")
            rows.append((case, alpha, str(len(steps)), str(settled([step[1] for step in steps])), *ends))
    columns = ("case", "alpha", "steps", "settled at step", "trim30 splat to CT, first step", "last step",
               "volume drift %, last step")  # fmt: skip
    return Table("The paper's Figure 8", columns, tuple(rows), f"{FIGURE_8_NOTE} {figure_8_found(runs)}")


def settled(values: Sequence[float]) -> int:
    """First step (from 1) from which on all values lie within 2 % of the last."""
    away = [step for step, value in enumerate(values, 1) if abs(value - values[-1]) > 0.02 * abs(values[-1])]
    return max(away, default=0) + 1


def figure_8_found(runs: RunSet) -> str:
    """In how many cases the curves end in the order that the paper tells, and how many of them rise."""
    cases = [
        [run["facts"]["figure_8"][alpha] for alpha in ALPHAS]
        for (_, method), run in runs.baseline.items()
        if method == "paper_figure_8" and not run["failure"]
    ]
    ends = [[steps[-1] for steps in curves] for curves in cases]
    lowest = sum(case[-1][1] == min(residual for _, residual, _ in case) for case in ends)
    shrunk = sum(case[-1][2] == min(0.0, *(drift for _, _, drift in case)) for case in ends)
    risen = sum(steps[-1][1] > steps[0][1] for curves in cases for steps in curves)
    return (
        f"Here alpha 0.005 ends with the lowest residual in {lowest} of {len(ends)} cases, and with the smallest "
        f"volume, below the CT's, in {shrunk}. {risen} of {len(ALPHAS) * len(cases)} residuals end above their first "
        "step: what is minimised is the other direction, CT to splat."
    )


def _measured(run: Run, start: Run | None) -> Sequence[str]:
    figures, stages = run["figures"], run["figures"]["stages"]
    seconds, points, steps = run["seconds"], figures["points"], run["facts"]["steps"]
    step_s = seconds["elastic"]["processor_s"] / max(len(steps), 1)
    tre = f"{stages['rigid']['tre_mm']['all']['mean']:.2f} / {figures['tre_mm']['all']['mean']:.2f}"
    pairs = ["-" if part is None else _pair(*_ct_to_splat(part)) for part in (start, stages["rigid"], figures)]
    counts = (str(points["ct_surface"]), str(points["splat"]))
    return (*counts, f"{seconds['rigid']['processor_s']:.1f}", f"{step_s:.2f}", *pairs, tre)


def _printed(row: PaperRow) -> Sequence[str]:
    pairs = [_pair(*stage) for stage in (row.coarse, row.rigid, row.elastic)]
    return (str(row.ct_points), str(row.splat_points), f"{row.rigid_s:g}", f"{row.elastic_step_s:g}", *pairs, "-")


def _ct_to_splat(part: Run) -> tuple[float, float]:
    residuals = part["residuals"]
    return residuals["mean_ct_to_splat_normalised"], residuals["trim30_ct_to_splat_normalised"]


def _pair(mean: float, trimmed: float) -> str:
    return f"{mean:.3f} / {trimmed:.3f}"
