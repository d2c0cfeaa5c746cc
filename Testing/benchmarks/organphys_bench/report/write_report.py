"""bench.json, bench.html and, if asked for, parts of RESULTS.md from finished runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from html import escape
from pathlib import Path

from organphys.ground.atomic_file import write_text

from .comparisons import not_ahead, solver_table, verdict_lines
from .main_tables import case_table, fit_table, main_table, region_table, time_table
from .page import listed, page, picture, plot
from .paper_tables import paper_tables
from .pictures import case_pictures, png
from .plots import figure_8_plot, ratio_plot, time_plot
from .results_part import TITLE, write_results
from .run_set import Run, RunSet
from .sweeps import sweep_curves


def write_report(
    runs: Sequence[Run], cases: dict[str, Path], out: Path, *, command: str, results: Path | None
) -> list[Path]:
    """Paths written. ``cases``: folders by name, for the pictures; ``results``: a Markdown file that gets parts."""
    found, how = RunSet(runs), how_lines(runs, command)
    written = [out / "bench.json", out / "bench.html"]
    write_text(written[0], json.dumps(summary(found, how), indent=1) + "\n")
    write_text(written[1], page(TITLE, html_parts(found, cases, how)))
    if results is not None:
        written += write_results(results, found, partial(how_lines, command=command))
    return written


def how_lines(runs: Sequence[Run], command: str) -> list[str]:
    """Command, date, machine, versions, and of which commits the runs are."""
    from results_file import machine_lines

    commits = sorted({run["commit"] for run in runs})
    dates = sorted({run["date"] for run in runs})
    lines = [line.removeprefix("- ") for line in machine_lines(command)]
    return [*lines, f"{len(runs)} runs of {', '.join(dates)}, commit {', '.join(commits)}, one BLAS thread each"]


def summary(runs: RunSet, how: Sequence[str]) -> dict:
    """Everything but the pictures' data, for programs."""
    bare = [{name: value for name, value in run.items() if name != "picture"} for run in runs.runs]
    return {"how": list(how), "verdict": verdict_lines(runs), "not_ahead": not_ahead(runs), "runs": bare}


def html_parts(runs: RunSet, cases: dict[str, Path], how: Sequence[str]) -> list[str]:
    parts = [listed(how), "<h2>Accuracy</h2>", main_table(runs).html, plot(ratio_plot(runs), "TRE by method and case")]
    if verdict := verdict_lines(runs):
        parts += ["<h3>OrganPhys against each</h3>", listed(verdict), _not_ahead_html(runs)]
    parts += [region_table(runs).html, fit_table(runs).html]
    parts += ["<h2>Time and memory</h2>", time_table(runs).html, plot(time_plot(runs), "TRE against time")]
    if (solver := solver_table(runs)) is not None:
        parts.append(solver.html)
    if tables := paper_tables(runs):
        parts += ["<h2>The paper's own tables</h2>", *(table.html for table in tables)]
    if (drawn := figure_8_plot(runs)) is not None:
        parts.append(plot(drawn, "Figure 8 of the paper on these cases"))
    for curves in sweep_curves(runs):
        parts += [
            f"<h2>Sweep: {curves.sweep.name}</h2>",
            plot(curves.plot, f"TRE and success over {curves.sweep.label}"),
        ]
        parts.append(curves.table.html)
    parts += ["<h2>Pictures</h2>", PICTURES_NOTE]
    for case in runs.cases:
        images = [picture(png(image), caption) for caption, image in case_pictures(runs, case, cases[case])]
        parts += [f"<h3>{case}</h3>", f"<p>{escape(origin(cases[case]))}</p>", *images]
    parts.append(case_table(runs).html)
    if failures := runs.failures():
        parts += ["<h2>Runs without a result</h2>", listed(failures)]
    return parts


def origin(folder: Path) -> str:
    """Where a case's organ is from, as its case.json says."""
    facts = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    told = [str(facts[name]) for name in ("source", "licence") if facts.get(name)]
    return f"Organ: {'; '.join(told)}" if told else "Organ: origin and licence not stated."


PICTURES_NOTE = (
    "<p>The organ as each method maps it, on the splat, from the camera and from the side; colour: TRE of the surface "
    "near by, from blue (0) to red (three times the mean TRE of the best similarity, or more).</p>"
)


def _not_ahead_html(runs: RunSet) -> str:
    lines = not_ahead(runs)
    return "<h3>Where OrganPhys is not ahead</h3>" + (listed(lines) if lines else "<p>Nowhere.</p>")
