"""Stand-in for ctkCollapsibleButton."""

from __future__ import annotations

from typing import Any

from PySide6 import QtCore, QtGui, QtWidgets
from PySide6.QtCore import Property, Signal

from .stand_in import held, parent_of
from .ui_loader import stand_in

HEADER = 26


def fold(widget: QtWidgets.QWidget, collapsed: bool) -> None:
    """Hide the children of ``widget``, or show again those that were not hidden on purpose."""
    for child in widget.children():
        if not isinstance(child, QtWidgets.QWidget):
            continue
        if collapsed and not child.isHidden():
            child.setProperty("_folded", True)
            child.hide()
        elif not collapsed and child.property("_folded"):
            child.setProperty("_folded", False)
            child.show()


@stand_in
class ctkCollapsibleButton(QtWidgets.QAbstractButton):
    contentsCollapsed = Signal(bool)
    collapsedHeight = held(int, "collapsedHeight", 10)
    flat = held(bool, "flat", False)
    contentsFrameShape = held(int, "contentsFrameShape", 0)

    def __init__(self, *arguments: Any) -> None:
        super().__init__(parent_of(arguments))
        if arguments and isinstance(arguments[0], str):
            self.setText(arguments[0])
        self._collapsed = False
        self.setContentsMargins(0, HEADER, 0, 0)
        self.setCheckable(True)
        self.setChecked(True)
        self.setSizePolicy(QtWidgets.QSizePolicy.Expanding, QtWidgets.QSizePolicy.Preferred)
        self.clicked.connect(lambda *_: self.setCollapsed(not self._collapsed))

    def setCollapsed(self, collapsed: bool) -> None:
        changed, self._collapsed = bool(collapsed) != self._collapsed, bool(collapsed)
        fold(self, self._collapsed)
        self.setChecked(not self._collapsed)
        self.updateGeometry()
        if changed:
            self.contentsCollapsed.emit(self._collapsed)

    collapsed = Property(bool, lambda self: self._collapsed, setCollapsed)

    def showEvent(self, event: QtGui.QShowEvent) -> None:
        super().showEvent(event)
        fold(self, self._collapsed)

    def sizeHint(self) -> QtCore.QSize:
        content = None if self._collapsed else self.layout()
        return QtCore.QSize(120, HEADER) if content is None else content.totalSizeHint()

    def minimumSizeHint(self) -> QtCore.QSize:
        content = None if self._collapsed else self.layout()
        return QtCore.QSize(60, HEADER) if content is None else content.totalMinimumSize()

    def paintEvent(self, event: QtGui.QPaintEvent) -> None:
        painter, option = QtGui.QPainter(self), QtWidgets.QStyleOption()
        option.initFrom(self)
        frame = QtCore.QRectF(option.rect).adjusted(0.5, 0.5, -0.5, -0.5)
        header = QtCore.QRectF(frame.x(), frame.y(), frame.width(), HEADER - 3)
        painter.setRenderHint(QtGui.QPainter.Antialiasing)
        painter.setPen(QtGui.QColor(190, 190, 190))
        painter.setBrush(QtGui.QColor(226, 229, 233))
        painter.drawRoundedRect(header, 3, 3)
        self._paint_arrow(painter, header)
        font = painter.font()
        font.setBold(True)
        painter.setFont(font)
        painter.setPen(QtGui.QColor(35, 35, 35))
        text = QtCore.QObject.property(self, "text")
        painter.drawText(header.adjusted(22, 0, -6, 0), int(QtCore.Qt.AlignmentFlag.AlignVCenter.value), text)

    def _paint_arrow(self, painter: QtGui.QPainter, header: QtCore.QRectF) -> None:
        x, y = header.x() + 11, header.center().y()
        corners = [(-3, -4), (-3, 4), (3, 0)] if self._collapsed else [(-4, -2), (4, -2), (0, 4)]
        painter.save()
        painter.setPen(QtCore.Qt.PenStyle.NoPen)
        painter.setBrush(QtGui.QColor(70, 70, 70))
        painter.drawPolygon(QtGui.QPolygonF([QtCore.QPointF(x + dx, y + dy) for dx, dy in corners]))
        painter.restore()
