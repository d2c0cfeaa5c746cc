"""Pieces of the report's HTML: every text is escaped here, nothing is loaded from anywhere."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from ..ground.notices import Notice
from ..ground.plain_json import plain
from .report_content import VerdictText

STYLE = """
:root{--ink:#1c2430;--soft:#5b6472;--rule:#dfe3ea;--blue:#2f6fde}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1000px;padding:36px 24px 60px;color:var(--ink);background:#fff;
 font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
h1{font-size:27px;line-height:1.2;margin:0 0 4px;letter-spacing:-.01em}
h2{font-size:18px;margin:38px 0 10px;padding-top:14px;border-top:1px solid var(--rule)}
h3{font-size:15px;margin:20px 0 6px}
p{margin:6px 0 10px;max-width:78ch} .soft{color:var(--soft)}
.verdict{border-left:6px solid #2e9b57;background:#eff8f2;padding:12px 18px;margin:20px 0;border-radius:0 6px 6px 0}
.verdict.warn{border-color:#d98200;background:#fff6e6} .verdict.stop{border-color:#c2261d;background:#fdeeec}
.verdict strong{font-size:17px} .verdict ul{margin:8px 0 2px;padding-left:20px} .verdict li{margin:5px 0}
.verdict code{font-size:12px;color:var(--soft)}
.tiles{display:flex;flex-wrap:wrap;gap:10px;margin:16px 0}
.tile{flex:1 1 150px;border:1px solid var(--rule);border-radius:6px;padding:8px 14px}
.tile b{display:block;font-size:19px;font-variant-numeric:tabular-nums} .tile span{color:var(--soft);font-size:13px}
table{border-collapse:collapse;margin:8px 0 14px;font-variant-numeric:tabular-nums;font-size:14px}
th,td{padding:4px 16px 4px 0;text-align:left;border-bottom:1px solid var(--rule);vertical-align:top;
 overflow-wrap:anywhere}
th{color:var(--soft);font-weight:600} td.n,th.n{text-align:right;white-space:nowrap}
.grid{display:grid;grid-template-columns:repeat(3,1fr);gap:6px;margin:0 0 12px}
.two{grid-template-columns:repeat(2,1fr);gap:12px}
figure{margin:0} figcaption{color:var(--soft);font-size:13px;margin:3px 0}
svg{display:block;width:100%;height:auto} .grid svg{border-radius:4px}
svg text{font-family:system-ui,-apple-system,"Segoe UI",Roboto,Arial,sans-serif!important}
pre{font-size:12px;line-height:1.45;background:#f6f7f9;padding:12px 14px;border-radius:6px;white-space:pre-wrap;
 overflow-wrap:anywhere}
@page{margin:14mm}
@media print{body{padding:0;max-width:none;font-size:12px}*{print-color-adjust:exact;-webkit-print-color-adjust:exact}
 .row,figure,table,.verdict{break-inside:avoid} h2,h3{break-after:avoid}}
"""


def page(title: str, body: Iterable[str]) -> str:
    """The whole HTML text."""
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{escape(title)}</title>'
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}<style>{STYLE}</style></head>\n<body>\n'
        + "\n".join(part for part in body if part)
        + "\n</body></html>\n"
    )


def heading(words: str, *, level: int = 2) -> str:
    return f"<h{level}>{escape(words)}</h{level}>"


def paragraph(words: str, *, soft: bool = False) -> str:
    if not words:
        return ""
    return f'<p class="soft">{escape(words)}</p>' if soft else f"<p>{escape(words)}</p>"


def verdict_box(verdict: VerdictText | None, notices: Sequence[Notice]) -> str:
    """Verdict, its reasons and the other warnings in plain words, before anything else; without a verdict the number
    of warnings is the headline."""
    count, reasons = len(notices), verdict.reasons if verdict is not None else ()
    warned = "No warnings." if not count else f"{count} warning{'s' if count > 1 else ''}: read before use."
    told = {reason.code: reason.message for reason in reasons}
    told |= {notice.code: notice.message for notice in notices if notice.code not in told}
    items = "".join(f"<li>{escape(message)} <code>{escape(code)}</code></li>" for code, message in told.items())
    colour = " warn" if count else ""
    if verdict is not None:
        colour = {"trust": "", "check": " warn"}.get(verdict.level, " stop")
    headline = verdict.headline if verdict is not None else warned
    return (
        f'<div class="verdict{colour}"><strong>{escape(headline)}</strong>'
        + (f"<ul>{items}</ul>" if items else "")
        + "</div>"
    )


def tiles(pairs: Sequence[tuple[str, str]]) -> str:
    """Large figures with their names below."""
    if not pairs:
        return ""
    cells = "".join(f'<div class="tile"><b>{escape(str(v))}</b><span>{escape(str(k))}</span></div>' for k, v in pairs)
    return f'<div class="tiles">{cells}</div>'


def table(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Rows of text and numbers; a column of numbers is set to the right."""
    if not rows:
        return ""
    numeric = [all(_is_number(row[k]) or row[k] is None for row in rows) for k in range(len(rows[0]))]
    mark = [' class="n"' if right else "" for right in numeric]
    head = "".join(f"<th{m}>{escape(str(c))}</th>" for m, c in zip(mark, columns, strict=True)) if columns else ""
    lines = ["".join(f"<td{m}>{escape(words(cell))}</td>" for m, cell in zip(mark, row, strict=True)) for row in rows]
    return "<table>" + (f"<tr>{head}</tr>" if head else "") + "".join(f"<tr>{text}</tr>" for text in lines) + "</table>"


def grid(pictures: Sequence[tuple[str, str]], *, two: bool = False) -> str:
    """Caption and SVG (trusted) of pictures side by side."""
    cells = "".join(f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>" for caption, svg in pictures)
    return f'<div class="grid row{" two" if two else ""}">{cells}</div>'


def listing(value: Mapping[str, Any]) -> str:
    """Provenance as indented JSON."""
    return f"<pre>{escape(json.dumps(plain(value), indent=2, ensure_ascii=False))}</pre>" if value else ""


def words(value: Any) -> str:
    """Cell text: numbers to three significant digits (whole ones in full), a dash for what is missing."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if _is_number(value):
        number = float(value)
        return f"{number:,.0f}" if number == int(number) or abs(number) >= 1000 else f"{number:.3g}"
    return str(value)


def _is_number(value: Any) -> bool:
    return isinstance(plain(value), (int, float)) and not isinstance(value, bool)
