"""The coloured, wrapped box in which the panel talks to the user."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

# background, border and text are all set, so that the box can be read in the light and in the dark style
COLOURS = {
    "error": ("#fdeaea", "#c43c3c", "#5a1616"),
    "warning": ("#fff5d9", "#d9a013", "#4a3800"),
    "good": ("#e8f5ec", "#3c9a5f", "#143d24"),
    "info": ("#e8f0fa", "#4a7fc1", "#14304f"),
}
STYLE = "background: {}; border: 1px solid {}; border-radius: 3px; color: {}; padding: 5px;"


def show_message(label: Any, lines: str | Sequence[str], kind: str) -> None:
    """Write ``lines``, one paragraph or a list of points, into a QLabel; nothing hides it.

    ``kind``: a key of COLOURS, or "plain" for text without a box.
    """
    points = [lines] if isinstance(lines, str) else list(lines)
    points = [html.escape(point, quote=False) for point in points if point]
    label.styleSheet = STYLE.format(*COLOURS[kind]) if kind in COLOURS else ""
    label.text = "<br>".join(points) if len(points) < 2 else "".join(f"<div>• {point}</div>" for point in points)
    label.visible = bool(points)
