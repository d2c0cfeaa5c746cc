"""report.html: what went in, what came out, how far to trust it; one file that needs nothing else."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from ..ground.atomic_file import write_text
from ..ground.plain_json import plain
from .coarse_pictures import coarse_pictures
from .picture_svg import svg_picture
from .plots import convergence_plot, histogram_plot, twist_plot
from .report_content import ReportContent, StepFigures
from .report_page import grid, heading, listing, page, paragraph, table, tiles, verdict_box, words
from .report_pictures import overlay_rows

OVERLAY_NOTE = (
    "The splat in its own colours; the registered CT organ as a blue glaze with a light outline: stronger where it "
    "lies before the splat, fainter behind it, full where nothing was seen. In the distance pictures, red or grey far "
    "from the splat means that nothing was seen there. The last row shows how far the true position of every point may "
    "be from the shown one, also on the side that nothing shows."
)


def write_report(path: str | os.PathLike[str], content: ReportContent) -> None:
    """Write the report to ``path``, atomically; InputError where it cannot be written."""
    write_text(path, report_html(content))


def report_html(content: ReportContent) -> str:
    """The report as one HTML text with pictures and plots inside."""
    method = f"method: {content.method}" if content.method else ""
    body = [heading(content.title, level=1), paragraph(method, soft=True)]
    body += [verdict_box(content.verdict, content.notices), tiles(content.highlights)]
    body += _tables(content.extra_tables) + _strips(content)
    body += _section("Inputs", table((), [tuple(row) for row in content.inputs]))
    body += _overlays(content)
    body += _section("Distances that remain", _histogram(content))
    body += _section("Elastic stage", _curves(content.steps))
    body += _coarse(content)
    body += _section("Figures of every stage", _metrics(content.metrics))
    body += _section("Time and stops", _times(content.seconds) + _stops(content.stops))
    body += _section("Provenance", listing(content.provenance))
    return page(content.title, body)


def _section(name: str, inner: str) -> list[str]:
    return [heading(name), inner] if inner else []


def _tables(tables: Any) -> list[str]:
    parts = []
    for entry in tables:
        parts += [heading(entry.title), paragraph(entry.note, soft=True), table(entry.columns, entry.rows)]
    return parts


def _strips(content: ReportContent) -> list[str]:
    parts = []
    for strip in content.extra_strips:
        pictures = [(caption, svg_picture(image, title=caption)) for caption, image in strip.pictures]
        parts += [heading(strip.title), paragraph(strip.note, soft=True), grid(pictures)]
    return parts


def _overlays(content: ReportContent) -> list[str]:
    rows = overlay_rows(content)
    if not rows:
        return []
    parts = [heading("Overlay on the endoscopic splat"), paragraph(OVERLAY_NOTE, soft=True)]
    for row in rows:
        parts += [
            heading(row.name[:1].upper() + row.name[1:], level=3),
            grid(list(zip(row.views, row.pictures, strict=True))),
        ]
    return parts


def _histogram(content: ReportContent) -> str:
    if content.splat_to_ct_mm is None and content.ct_visible_to_splat_mm is None:
        return ""
    return histogram_plot(content.splat_to_ct_mm, content.ct_visible_to_splat_mm)


def _curves(steps: Sequence[StepFigures]) -> str:
    """The curves, and why their distances are larger than those of the table."""
    if not steps:
        return ""
    note = (
        "The distances of the curve are to a sample of the CT surface that the solver uses; those of the table below "
        "are to every vertex of it and therefore smaller."
    )
    return paragraph(note, soft=True) + convergence_plot(steps)


def _coarse(content: ReportContent) -> list[str]:
    if content.coarse is None:
        return []
    parts = [heading("Coarse stage"), grid(coarse_pictures(content, content.coarse), two=True)]
    return parts + ([twist_plot(content.coarse)] if len(content.coarse.twist_costs) else [])


def _metrics(metrics: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """One row per figure, one column per stage."""
    names = {(name, entry.get("unit", "")): None for stage in metrics.values() for name, entry in stage.items()}
    rows = []
    for name, unit in names:
        entries = [stage.get(name, {}) for stage in metrics.values()]
        values = [entry.get("value") if entry.get("unit", "") == unit else None for entry in entries]
        rows.append((_spoken(name), unit, *values))
    return table(("", "unit", *metrics), rows)


def _spoken(name: str) -> str:
    """A metric's name for readers."""
    special = {"ct": "CT", "f": "F"}
    return " ".join(special.get(part, part) for part in name.split("_"))


def _times(seconds: Mapping[str, float]) -> str:
    return table(tuple(seconds), [[f"{value:.2f} s" for value in seconds.values()]]) if seconds else ""


def _stops(stops: Mapping[str, Any]) -> str:
    return table(("solver", "stopped because"), [(name, _reason(stop)) for name, stop in stops.items()])


def _reason(stop: Any) -> str:
    """Readable text of a stop: a word, or a record (``SolveReport`` or a dict) with its numbers."""
    entry = plain(stop)
    if not isinstance(entry, Mapping):
        return str(entry)
    numbers = [f"{key.replace('_', ' ')} {words(value)}" for key, value in entry.items() if key != "stop" and value]
    return str(entry.get("stop", "")) + (f" ({', '.join(numbers)})" if numbers else "")
