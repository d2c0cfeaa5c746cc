"""A small line plot, drawn into a label: quicker than a plot view, and it needs no nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import qt

HEIGHT, LEFT, MARGIN = 64, 4, 4
LINE, GRID, BACK, TEXT = "#d2553f", "#b9c3cf", "#f7f9fb", "#42505e"
STEPS = (1.0, 2.0, 5.0)


class LivePlot:
    """``label``: QLabel that shows it; ``title`` with the unit; from ``least`` up the axis grows with the values."""

    def __init__(self, label: Any, title: str, *, least: float, both_ways: bool = False) -> None:
        self._label, self._title, self._least, self._both_ways = label, title, least, both_ways
        label.setMinimumHeight(HEIGHT)
        label.setMinimumWidth(80)
        self.show([])

    def show(self, values: Sequence[float]) -> None:
        """Draw the values, oldest first; as many as fit are spread over the width."""
        width = max(80, min(self._label.width, 600))
        ratio = 2  # for screens with small pixels
        picture = qt.QPixmap(ratio * width, ratio * HEIGHT)
        picture.fill(qt.QColor(BACK))
        painter = qt.QPainter()
        painter.begin(picture)
        painter.scale(ratio, ratio)
        painter.setRenderHint(qt.QPainter.Antialiasing, True)
        self._draw(painter, width, list(values))
        painter.end()
        picture.setDevicePixelRatio(ratio)
        self._label.setPixmap(picture)

    def _draw(self, painter: Any, width: int, values: list[float]) -> None:
        top = nice_top(max((abs(value) for value in values), default=0.0), self._least)
        low = -top if self._both_ways else 0.0
        bottom, upper = HEIGHT - MARGIN, 16
        zero = bottom - (0 - low) / (top - low) * (bottom - upper)
        painter.setPen(_pen(GRID))
        painter.drawLine(LEFT, round(zero), width - MARGIN, round(zero))
        painter.drawLine(LEFT, upper, width - MARGIN, upper)
        painter.setPen(_pen(TEXT))
        painter.drawText(LEFT, 11, f"{self._title}, {'±' if self._both_ways else '0–'}{top:g}")
        if len(values) < 2:
            return
        path, step = qt.QPainterPath(), (width - MARGIN - LEFT) / (len(values) - 1)
        for k, value in enumerate(values):
            x, y = LEFT + k * step, bottom - (value - low) / (top - low) * (bottom - upper)
            if k:
                path.lineTo(x, y)
            else:
                path.moveTo(x, y)
        painter.setPen(_pen(LINE, 1.5))
        painter.drawPath(path)


def _pen(colour: str, width: float = 1.0) -> Any:
    pen = qt.QPen(qt.QColor(colour))
    pen.setWidthF(width)
    return pen


def nice_top(highest: float, least: float) -> float:
    """1, 2 or 5 times a power of ten that is at least both numbers."""
    wanted, power = max(highest, least), 1e-6
    while True:
        for step in STEPS:
            if step * power >= wanted * (1 - 1e-9):
                return step * power
        power *= 10
