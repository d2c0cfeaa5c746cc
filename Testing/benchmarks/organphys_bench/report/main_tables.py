"""The tables over all cases as they are: accuracy, residuals and deformation, time and memory."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..peers.methods import METHODS
from .run_set import Run, RunSet, mean_tre, number, ratio
from .table import Table

REGIONS = ("visible", "hidden", "interior")


def main_table(runs: RunSet) -> Table:
    """Mean TRE of every case, and over the cases as a ratio to the best similarity."""
    oracle = [f"({number(runs.oracle_mm(case))})" for case in runs.cases]
    rows = [("best similarity, from the truth", *oracle, "(1.00)", "(1.00)")]
    if np.isfinite([runs.start_mm(case) for case in runs.cases]).any():
        ratios = np.array([runs.start_mm(case) / runs.oracle_mm(case) for case in runs.cases])
        cells = [number(runs.start_mm(case)) for case in runs.cases]
        rows.append(("the common start", *cells, number(ratios.mean()), number(ratios.max())))
    for method in runs.methods:
        ratios = runs.values(method, ratio)
        cells = [number(value) for value in runs.values(method, mean_tre)]
        rows.append((METHODS[method].title, *cells, number(ratios.mean()), number(ratios.max())))
    rows = [rows[0], *rows[1:]]
    return Table(
        "Mean TRE, mm",
        ("method", *runs.cases, "mean ratio", "worst ratio"),
        tuple(rows),
        "Distance of 1500 mapped CT points (surface and interior) from their true place; ratio: to the best rigid "
        "motion with scale there is, fitted to the truth. Every peer begins at the same start, the best pose of "
        "OrganPhys's global search with the landmarks; 'the paper's method' and OrganPhys find their own.",
        frozenset(range(1, len(runs.cases) + 3)),
    )


def region_table(runs: RunSet) -> Table:
    """Mean TRE by region, and median, 95th percentile and maximum, means over the cases."""
    columns: list[Callable[[Run], float]] = [lambda f, r=region: f["tre_mm"][r]["mean"] for region in REGIONS]
    columns += [lambda f, s=statistic: f["tre_mm"]["all"][s] for statistic in ("median", "p95", "max")]
    columns.append(lambda f: abs(f["scale_error_percent"]))
    names = ("visible", "hidden", "interior", "median", "p95", "max", "scale error %, absolute")
    return _means(
        runs, "TRE by region, mm, mean over the cases", names, columns, 2,
        "visible: reconstructed surface; hidden: the rest of the surface; interior: inside. Median, p95 and max are "
        "over all points of a case. Scale error: of the similarity, against the true unit.", best=range(1, 7),
    )  # fmt: skip


def fit_table(runs: RunSet) -> Table:
    """Residuals both ways in the paper's unit, volume and strain, means over the cases."""
    names, columns = [], []
    for way in ("ct_to_splat", "splat_to_ct"):
        for statistic in ("mean", "trim30"):
            key = f"{statistic}_{way}_normalised"
            names.append(f"{statistic} {way.replace('_', ' ').replace('ct', 'CT')}")
            columns.append(lambda f, k=key: f["residuals"][k])
    names += ["volume drift %, absolute", "lowest det F", "highest det F", "largest stretch p95", "smallest stretch p5"]
    columns += [
        lambda f: abs(f["deformation"]["volume_drift_percent"]),
        lambda f: f["deformation"]["min_det_f"],
        lambda f: f["deformation"]["max_det_f"],
        lambda f: f["deformation"]["largest_stretch"]["p95"],
        lambda f: f["deformation"]["smallest_stretch"]["p5"],
    ]
    return _means(
        runs, "Residuals and deformation, mean over the cases", names, columns, 3,
        "Distances between the CT's boundary voxels (at most 10,000) and 5000 splat points as in the paper's Table 2, "
        "in units of the CT surface's largest coordinate. trim30: without the worst 30 %. Deformation beyond the "
        "method's similarity at 2000 points inside, by differences of its map.",
    )  # fmt: skip


def time_table(runs: RunSet) -> Table:
    """Seconds and memory, means and maxima over the cases."""
    rows = []
    for method in runs.methods:
        done = [run for case in runs.cases if (run := runs.baseline.get((case, method))) and not run["failure"]]
        if not done:
            continue
        processor = [run["seconds"]["total"]["processor_s"] for run in done]
        wall = [run["seconds"]["total"]["wall_s"] for run in done]
        memory = [run["peak_memory_mb"] or np.nan for run in done]
        rows.append(
            (METHODS[method].title, number(np.mean(processor), 1), number(np.max(processor), 1),
             number(np.mean(wall), 1), number(np.max(memory), 0), stage_seconds(done))
        )  # fmt: skip
    return Table(
        "Time and memory",
        ("method", "processor s, mean", "processor s, max", "wall s, mean", "peak MB", "processor s by stage, mean"),
        tuple(rows),
        "The registration alone, files read already; on a machine that does other work too wall seconds say little. "
        f"Peak memory is that of the whole process. The start costs every peer the same. All together: "
        f"{_minutes(runs):.0f} processor minutes.",
    )


def _minutes(runs: RunSet) -> float:
    """Processor minutes of the registrations of the tables over all cases."""
    done = [run["seconds"]["total"]["processor_s"] for run in runs.baseline.values() if not run["failure"]]
    return sum(done) / 60


def stage_seconds(done: list[Run]) -> str:
    """Mean processor seconds of the stages, in order."""
    names = dict.fromkeys(name for run in done for name in run["seconds"] if name != "total")
    spent = {name: [run["seconds"][name]["processor_s"] for run in done if name in run["seconds"]] for name in names}
    return ", ".join(f"{name} {np.mean(seconds):.1f}" for name, seconds in spent.items())


def case_table(runs: RunSet) -> Table:
    """Every baseline run with its main figures."""
    rows = []
    for (case, method), run in sorted(runs.baseline.items()):
        if METHODS[method].extra or run["failure"]:
            continue
        f = run["figures"]
        tre, drift = f["tre_mm"], f["deformation"]
        rows.append(
            (case, METHODS[method].title, *(number(tre["all"][s]) for s in ("mean", "median", "p95", "max")),
             *(number(tre.get(region, {"mean": np.nan})["mean"]) for region in REGIONS), number(f["ratio_to_oracle"]),
             f"{f['scale_error_percent']:+.1f}", f"{drift['volume_drift_percent']:+.2f}", number(drift["min_det_f"]),
             number(drift["max_det_f"]), number(run["seconds"]["total"]["processor_s"], 1))
        )  # fmt: skip
    columns = ("case", "method", "mean", "median", "p95", "max", *REGIONS, "ratio", "scale error %", "volume drift %")
    return Table("Every run", (*columns, "min det F", "max det F", "processor s"), tuple(rows), "TRE in mm.")


def _means(
    runs: RunSet, title: str, names, columns, digits: int, note: str, best: range | tuple[int, ...] = ()
) -> Table:
    rows = []
    for method in runs.methods:
        cells = [number(float(np.mean(runs.values(method, read))), digits) for read in columns]
        rows.append((METHODS[method].title, *cells))
    return Table(title, ("method", *names), tuple(rows), note, frozenset(best))
