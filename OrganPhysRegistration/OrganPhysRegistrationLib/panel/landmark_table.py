"""The placed landmarks by name and place in a small table; names can be edited in it."""

from __future__ import annotations

from typing import Any

import qt
import slicer
from slicer.i18n import tr as _

MOST_ROWS = 3  # before the table scrolls


class LandmarkTable:
    """``table``: QTableWidget with two columns. ``show`` fills it; an edited name goes back to the point."""

    def __init__(self, table: Any) -> None:
        self._table, self._node, self._filling = table, None, False
        self._indices: list[int] = []
        table.setHorizontalHeaderLabels([_("Landmark"), _("R, A, S (mm)")])
        table.horizontalHeader().setStretchLastSection(True)
        table.verticalHeader().hide()
        table.connect("cellChanged(int,int)", self._edited)

    def show(self, node: Any) -> int:
        """Fill the table from a point list or None; returns how many points are placed."""
        self._node, self._indices = node, placed_points(node)
        self._filling = True
        try:
            self._table.setRowCount(len(self._indices))
            for row, index in enumerate(self._indices):
                position = [0.0, 0.0, 0.0]
                node.GetNthControlPointPositionWorld(index, position)
                self._write(row, 0, node.GetNthControlPointLabel(index))
                self._write(row, 1, ", ".join(f"{x:.1f}" for x in position))
            self._fit()
        finally:
            self._filling = False
        self._table.visible = bool(self._indices)
        return len(self._indices)

    def _write(self, row: int, column: int, text: str) -> None:
        item = self._table.item(row, column)
        if item is None or item.text() != text:
            self._table.setItem(row, column, qt.QTableWidgetItem(text))

    def _fit(self) -> None:
        """As high as its rows."""
        table = self._table
        table.resizeRowsToContents()
        rows = sum(table.rowHeight(row) for row in range(min(len(self._indices), MOST_ROWS)))
        table.setFixedHeight(rows + table.horizontalHeader().sizeHint.height() + 2 * table.frameWidth)

    def _edited(self, row: int, column: int) -> None:
        if not self._filling and column == 0 and self._node is not None:
            self._node.SetNthControlPointLabel(self._indices[row], self._table.item(row, 0).text())


def placed_points(node: Any) -> list[int]:
    """Indices of the points that have a position; the one under the mouse while placing has none."""
    count = node.GetNumberOfControlPoints() if node is not None else 0
    defined = slicer.vtkMRMLMarkupsNode.PositionDefined
    return [index for index in range(count) if node.GetNthControlPointPositionStatus(index) == defined]
