"""The part of RESULTS.md, with its plots as PNG files beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from .comparisons import not_ahead, solver_table, verdict_lines
from .main_tables import fit_table, main_table, region_table, time_table
from .paper_tables import paper_tables
from .plots import figure_8_plot, ratio_plot
from .run_set import RunSet
from .sweeps import sweep_curves

TITLE = "OrganPhys beside its peers"
DPI = 80


def write_results(path: Path, runs: RunSet, how: Sequence[str]) -> list[Path]:
    """Paths written: the Markdown file ``path``, of which this is one part, and the pictures that it shows."""
    from results_file import write_part

    pictures = {path.with_name(f"bench_{name}.png"): figure for name, figure in _figures(runs).items()}
    for file, figure in pictures.items():
        figure.savefig(file, dpi=DPI)
        plt.close(figure)
    write_part(path, markdown(runs, how, [file.name for file in pictures]))
    return [path, *pictures]


def markdown(runs: RunSet, how: Sequence[str], pictures: Sequence[str] = ()) -> str:
    """The part's text; ``pictures``: names of the files that it shows."""
    solver = solver_table(runs)
    parts = [f"# {TITLE}", _bullets(how), main_table(runs).markdown]
    if verdict := verdict_lines(runs):
        parts += ["OrganPhys, with landmarks, is:", _bullets(verdict), "## Where OrganPhys is not ahead"]
        parts.append(_bullets(not_ahead(runs)) or "Nowhere.")
    tables = [region_table(runs), fit_table(runs), time_table(runs), *([] if solver is None else [solver])]
    tables += [*paper_tables(runs), *(curves.table for curves in sweep_curves(runs))]
    parts += [table.markdown for table in tables]
    if pictures:
        parts += ["## Plots", *(f"![{name}]({name})" for name in pictures)]
    if failures := runs.failures():
        parts += ["## Runs without a result", _bullets(failures)]
    return "\n\n".join(parts) + "\n"


def _bullets(lines: Sequence[str]) -> str:
    return "\n".join(f"- {line}" for line in lines)


def _figures(runs: RunSet) -> dict[str, Figure]:
    """Plots by the names of their files."""
    found = {"ratio": ratio_plot(runs), "figure_8": figure_8_plot(runs)}
    found |= {curves.sweep.name: curves.plot for curves in sweep_curves(runs)}
    return {name: figure for name, figure in found.items() if figure is not None}
