"""The report as one HTML page that needs no other file."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from html import escape

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1250px;margin:2em auto;padding:0 1em;color:#1c2430;background:#fff}
h1,h2,h3{line-height:1.2}h2{margin-top:2.2em;border-bottom:1px solid #d5dbe3;padding-bottom:.2em}
table{border-collapse:collapse;font-size:13px;font-variant-numeric:tabular-nums}.wide{overflow-x:auto}
th,td{padding:.25em .6em;text-align:right;border-bottom:1px solid #e5e9ef}
td{white-space:nowrap}th{background:#f3f5f8;vertical-align:bottom}
th:first-child,td:first-child{text-align:left}tr:hover td{background:#f8fafc}
img.plot{max-width:100%;height:auto}figure{display:inline-block;margin:.4em .8em .4em 0}figcaption{font-size:13px}
li{margin:.2em 0}
"""


def page(title: str, parts: Sequence[str]) -> str:
    """A whole HTML document of ``parts``, HTML each."""
    body = "\n".join(parts)
    return (
        f"<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{escape(title)}</title>"
        f"<style>{STYLE}</style></head><body><h1>{escape(title)}</h1>\n{body}\n</body></html>\n"
    )


def plot(figure: Figure, alt: str) -> str:
    """A matplotlib figure as an image of the page; the figure is closed."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=110)
    plt.close(figure)
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return f"<img class='plot' alt='{escape(alt)}' src='data:image/png;base64,{data}'>"


def picture(data: str, caption: str) -> str:
    """An image with its caption."""
    text = escape(caption)
    return f"<figure><img alt='{text}' src='{data}'><figcaption>{text}</figcaption></figure>"


def listed(lines: Sequence[str]) -> str:
    """A bullet list."""
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"
