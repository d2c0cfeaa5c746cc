"""Small helpers of the widget stand-ins."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6 import QtWidgets
from PySide6.QtCore import Property


def parent_of(arguments: tuple[Any, ...]) -> QtWidgets.QWidget | None:
    """The parent among a widget's constructor arguments."""
    return next((a for a in arguments if isinstance(a, QtWidgets.QWidget)), None)


def held(kind: Any, name: str, default: Any, *, signal: str = "", changed: Callable[[Any], None] | None = None) -> Any:
    """A Q_PROPERTY that only holds its value; emits ``signal`` and calls ``changed(widget)`` when that changes."""
    key = "_held_" + name

    def read(self: Any) -> Any:
        return self.__dict__.get(key, default)

    def write(self: Any, value: Any) -> None:
        before = read(self)
        self.__dict__[key] = value
        if before == value:
            return
        if changed is not None:
            changed(self)
        if signal:
            getattr(self, signal).emit(value)

    return Property(kind, read, write)


def row_layout(widget: QtWidgets.QWidget, vertical: bool = False) -> QtWidgets.QBoxLayout:
    """A box layout without margins for the parts of a compound widget."""
    layout = QtWidgets.QVBoxLayout(widget) if vertical else QtWidgets.QHBoxLayout(widget)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(4)
    return layout
