"""The parts of RESULTS.md, with their plots as PNG files beside it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from .comparisons import not_ahead, solver_table, verdict_lines
from .main_tables import fit_table, main_table, region_table, time_table
from .paper_tables import paper_tables
from .plots import figure_8_plot, ratio_plot
from .run_set import Run, RunSet
from .sweeps import Curves, sweep_curves

TITLE = "OrganPhys beside its peers"
SWEEPS_TITLE = f"{TITLE}: sweeps"
DPI = 80


def write_results(path: Path, runs: RunSet, how: Callable[[Sequence[Run]], Sequence[str]]) -> list[Path]:
    """Paths written: the Markdown file ``path``, of which two parts are ours, the cases as they are and the sweeps, and
    the pictures that they show. ``how``: lines on how runs were made."""
    from results_file import write_part

    curves = sweep_curves(runs)
    as_they_are = RunSet(list(runs.baseline.values()))
    written = [path]
    if as_they_are.runs:
        pictures = _saved(path, {"ratio": ratio_plot(as_they_are), "figure_8": figure_8_plot(as_they_are)})
        write_part(path, markdown(as_they_are, how(as_they_are.runs), [file.name for file in pictures]))
        written += pictures
    if curves:
        swept = [run for one in curves for run in one.runs]
        pictures = _saved(path, {one.sweep.name: one.plot for one in curves})
        write_part(path, sweeps_markdown(curves, RunSet(swept), how(swept), [file.name for file in pictures]))
        written += pictures
    return written


def markdown(runs: RunSet, how: Sequence[str], pictures: Sequence[str] = ()) -> str:
    """The part's text; ``pictures``: names of the files that it shows."""
    solver = solver_table(runs)
    parts = [f"# {TITLE}", _bullets(how), main_table(runs).markdown]
    if verdict := verdict_lines(runs):
        parts += ["OrganPhys, with landmarks, is:", _bullets(verdict), "## Where OrganPhys is not ahead"]
        parts.append(_bullets(not_ahead(runs)) or "Nowhere.")
    tables = [region_table(runs), fit_table(runs), time_table(runs), *([] if solver is None else [solver])]
    parts += [table.markdown for table in [*tables, *paper_tables(runs)]]
    return _ended(parts, runs, pictures)


def sweeps_markdown(curves: Sequence[Curves], runs: RunSet, how: Sequence[str], pictures: Sequence[str]) -> str:
    """The same of the sweeps."""
    parts = [f"# {SWEEPS_TITLE}", _bullets(how), *(one.table.markdown for one in curves)]
    return _ended(parts, runs, pictures)


def _ended(parts: list[str], runs: RunSet, pictures: Sequence[str]) -> str:
    """The parts with plots and failures."""
    if pictures:
        parts += ["## Plots", *(f"![{name}]({name})" for name in pictures)]
    if failures := runs.failures():
        parts += ["## Runs without a result", _bullets(failures)]
    return "\n\n".join(parts) + "\n"


def _saved(path: Path, figures: Mapping[str, Figure | None]) -> list[Path]:
    """The figures that there are, as PNG files beside ``path``."""
    files = []
    for name, figure in figures.items():
        if figure is not None:
            files.append(path.with_name(f"bench_{name}.png"))
            figure.savefig(files[-1], dpi=DPI)
            plt.close(figure)
    return files


def _bullets(lines: Sequence[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)
