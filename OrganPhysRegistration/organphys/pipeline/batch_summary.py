"""summary.csv and summary.html of a batch: one line per case."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ..exports.report_page import heading, page, paragraph, tiles, words
from ..ground.atomic_file import write_text
from .batch_records import FAILED, KEPT, NOT_RUN, BatchCase, Outcome
from .verdict import LEVELS
from .write_outputs import REPORT

CSV, HTML = "summary.csv", "summary.html"
_FIXED = ("case", "line", "status", "seconds [s]")
_STYLE = """<style>body{max-width:1300px} .cases{overflow-x:auto}
.cases th,.cases td{overflow-wrap:normal;padding-right:14px}</style>"""
_RIGHT = ' class="n"'
_COLOUR = {"trust": "#2e9b57", "check": "#b06a00", "do not trust": "#c2261d", FAILED: "#c2261d"}


def write_summary(out: Path, cases: Sequence[BatchCase], outcomes: Mapping[str, Outcome]) -> None:
    """Both files, each atomically; cases without an outcome are told as not run."""
    told = [(case, outcomes.get(case.name, Outcome(NOT_RUN))) for case in cases]
    names = list(dict.fromkeys(name for _, outcome in told for name in outcome.result))
    write_text(out / CSV, _csv(told, names))
    write_text(out / HTML, _html(told, names))


def counts(cases: Sequence[BatchCase], outcomes: Mapping[str, Outcome]) -> str:
    """One line: how many cases are finished, were before, failed, and were not run."""
    found = Counter(outcomes[case.name].status if case.name in outcomes else NOT_RUN for case in cases)
    failed, left, kept = found[FAILED], found[NOT_RUN], found[KEPT]
    parts = [f"{len(cases) - failed - left} of {len(cases)} cases finished" + (f" ({kept} before)" if kept else "")]
    parts += [f"{number} {name}" for number, name in ((failed, "failed"), (left, "not run")) if number]
    return ", ".join(parts)


def _cells(case: BatchCase, outcome: Outcome, names: Sequence[str]) -> list[Any]:
    return [case.name, case.line, outcome.status, outcome.seconds, *(outcome.result.get(n) for n in names)]


def _csv(told: Sequence[tuple[BatchCase, Outcome]], names: Sequence[str]) -> str:
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*_FIXED, *names, "error"])
    for case, outcome in told:
        cells = [*_cells(case, outcome, names), outcome.error]
        writer.writerow([f"{cell:.6g}" if isinstance(cell, float) else cell for cell in cells])
    return stream.getvalue()


def _html(told: Sequence[tuple[BatchCase, Outcome]], names: Sequence[str]) -> str:
    cases, outcomes = [case for case, _ in told], {case.name: outcome for case, outcome in told}
    outcomes = {name: outcome for name, outcome in outcomes.items() if outcome.status != NOT_RUN}
    verdicts = Counter(str(o.result["verdict"]) for o in outcomes.values() if o.result.get("verdict"))
    failed = [(case, outcome) for case, outcome in told if outcome.status == FAILED]
    head = "".join(f"<th>{escape(name)}</th>" for name in (*_FIXED, *names))
    body = "".join(_row(case, outcome, names) for case, outcome in told)
    return page(
        f"Batch of {len(told)} cases",
        [
            heading(f"Batch of {len(told)} cases", level=1),
            paragraph(counts(cases, outcomes) + "."),
            tiles([(f"verdict: {name}", str(verdicts[name])) for name in LEVELS] + [("failed", str(len(failed)))]),
            heading("Failed") if failed else "",
            *(paragraph(f"{case.name} (line {case.line}): {outcome.error}") for case, outcome in failed),
            heading("Cases"),
            f'{_STYLE}<div class="cases"><table><tr>{head}</tr>{body}</table></div>',
        ],
    )


def _row(case: BatchCase, outcome: Outcome, names: Sequence[str]) -> str:
    values = _cells(case, outcome, names)
    cells = [f"<td{_RIGHT if isinstance(value, float) else ''}>{_coloured(words(value))}</td>" for value in values]
    if outcome.result:
        link = f"{quote(case.name)}/{REPORT}"
        cells[0] = f'<td><a href="{escape(link)}">{escape(case.name)}</a></td>'
    return f"<tr>{''.join(cells)}</tr>"


def _coloured(text: str) -> str:
    colour = _COLOUR.get(text)
    return escape(text) if colour is None else f'<b style="color:{colour}">{escape(text)}</b>'
