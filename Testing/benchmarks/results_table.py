"""RESULTS.md: what the benchmark found, as tables, with the machine and the versions."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cases import CaseOutcome, Outcome

DEFAULT = ("landmarks", "no landmarks", "with the unit")
STAGES = ("coarse", "rigid", "elastic")


def results_markdown(cases: Sequence[CaseOutcome], *, command: str) -> str:
    """The whole file."""
    names = list(cases[0].runs)
    default = [name for name in names if name in DEFAULT]
    paper = [name for name in names if name not in DEFAULT]
    parts = ["# Registration against known truth", _how(command)]
    if default:
        parts += ["## Default method", _ratios(cases, default), _times(cases, default), _regions(cases, default[0])]
    if paper:
        parts += ["## The paper's method", _paper(cases, paper)]
    failures = [
        f"- {case.name}, {name}: {run.failure}" for case in cases for name, run in case.runs.items() if run.failure
    ]
    if failures:
        parts += ["## Runs without a result", "\n".join(failures)]
    return "\n\n".join(parts) + "\n"


def _how(command: str) -> str:
    packages = ", ".join(f"{name} {version(name)}" for name in ("organphys", "numpy", "scipy"))
    return (
        "TRE is the mean distance of 1500 mapped CT points (surface and interior) from their true place. The oracle is "
        "the best possible similarity, fitted to the truth; ratio = TRE / oracle.\n\n"
        f"- command: `{command}`\n"
        f"- date: {datetime.date.today().isoformat()}, commit {_commit()}\n"
        f"- machine: {_processor()}, {os.cpu_count()} cores, {platform.system()}, "
        f"OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'not set')}\n"
        f"- versions: Python {platform.python_version()}, {packages}"
    )


def _ratios(cases: Sequence[CaseOutcome], names: Sequence[str]) -> str:
    """Ratio to the oracle and scale error of every variant."""
    rows, ratios = [], np.full((len(cases), len(names)), np.nan)
    for i, case in enumerate(cases):
        cells = [case.name, f"{case.oracle_mm['all']:.2f}"]
        for k, name in enumerate(names):
            run = case.runs[name]
            if not run.failure:
                ratios[i, k] = run.tre_mm["elastic"]["all"] / case.oracle_mm["all"]
            cells += [f"{ratios[i, k]:.2f}", f"{run.scale_error_percent:+.1f}"]
        rows.append(cells)
    for title, reduce in (("mean", np.mean), ("worst", np.max)):
        errors = [[abs(case.runs[name].scale_error_percent) for case in cases] for name in names]
        summary = [f"**{title}**", ""]
        for k in range(len(names)):
            summary += [f"**{reduce(ratios[:, k]):.2f}**", f"{reduce(errors[k]):.1f}"]
        rows.append(summary)
    columns = [cell for name in names for cell in (f"ratio, {name}", "scale error %")]
    return "Ratio of the TRE to the oracle (mean and worst scale errors are of absolute values):\n\n" + _table(
        ["case", "oracle mm", *columns], rows
    )


def _times(cases: Sequence[CaseOutcome], names: Sequence[str]) -> str:
    """Wall seconds of the whole command, seconds per stage and peak memory of the first variant."""
    stages = ("read", "coarse", "basis", "rigid", "elastic", "report", "total")
    rows = []
    for case in cases:
        record = case.runs[names[0]].record
        seconds = [f"{record['seconds'][stage]:.2f}" if record else "-" for stage in stages]
        walls = [f"{case.runs[name].wall_seconds:.1f}" for name in names]
        rows.append([case.name, *walls, *seconds, f"{record['peak_memory_mb']:.0f}" if record else "-"])
    columns = ["case", *(f"wall s, {name}" for name in names), *(f"{stage} s" for stage in stages), "peak MB"]
    return f"Time of the whole command, and of its stages and the memory of the runs `{names[0]}`:\n\n" + _table(
        columns, rows
    )


def _regions(cases: Sequence[CaseOutcome], name: str) -> str:
    """TRE of the stages over all points, and of the result in each region."""
    rows = []
    for case in cases:
        run = case.runs[name]
        stages = [_tre(run, stage, "all") for stage in STAGES]
        rows.append(
            [case.name, *stages, *(_tre(run, "elastic", region) for region in ("visible", "hidden", "interior"))]
        )
    return f"TRE in mm of the runs `{name}`, after each stage, and of the result by region:\n\n" + _table(
        ["case", *STAGES, "visible", "hidden", "interior"], rows
    )


def _paper(cases: Sequence[CaseOutcome], names: Sequence[str]) -> str:
    """TRE after each stage for every preset, with the residual and the volume drift that the paper reports."""
    rows = []
    for case in cases:
        first = case.runs[names[0]]
        row = [case.name, f"{case.oracle_mm['all']:.2f}", _tre(first, "coarse", "all"), _tre(first, "rigid", "all")]
        row += [_tre(case.runs[name], "elastic", "all") for name in names]
        for key in ("trim30_ct_to_splat", "volume_drift"):
            row += [_metric(case.runs[name], key) for name in names]
        rows.append([*row, *(f"{case.runs[name].wall_seconds:.0f}" for name in names)])
    short = [name.removeprefix("paper ") for name in names]
    columns = ["case", "oracle mm", "coarse TRE", "rigid TRE", *(f"TRE {name}" for name in short)]
    columns += [f"{what} {name}" for what in ("residual mm", "volume drift %", "wall s") for name in short]
    return (
        "TRE in mm with landmarks, RKPM weights. Residual: trim30 CT to splat after the elastic stage. The paper's "
        "finding holds where the residual falls and the volume drift grows from left to right.\n\n"
        + _table(columns, rows)
    )


def _tre(run: Outcome, stage: str, region: str) -> str:
    return "-" if run.failure else f"{run.tre_mm[stage].get(region, float('nan')):.2f}"


def _metric(run: Outcome, name: str) -> str:
    return "-" if run.failure else f"{run.record['metrics']['elastic'][name]['value']:.2f}"


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _commit() -> str:
    return _first_line(lambda: subprocess.check_output(["git", "rev-parse", "--short", "HEAD"], text=True))


def _processor() -> str:
    """The model of the CPU, where the system tells."""

    def from_proc() -> str:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1] for line in lines if line.startswith("model name"))

    return _first_line(from_proc, otherwise=platform.processor() or platform.machine())


def _first_line(read: Callable[[], str], *, otherwise: str = "unknown") -> str:
    try:
        return read().strip().splitlines()[0]
    except (OSError, StopIteration, IndexError, subprocess.CalledProcessError):
        return otherwise
