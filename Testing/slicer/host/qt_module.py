"""The ``qt`` module: PySide6 as PythonQt shows it."""

from __future__ import annotations

import importlib
import sys
import types
from collections.abc import Callable
from typing import Any

from PySide6 import QtCore

from . import qt_attributes, qt_dialogs

PARTS = ("QtCore", "QtGui", "QtWidgets", "QtUiTools")


def install() -> types.ModuleType:
    """Patch PySide6 once and register ``qt`` in sys.modules."""
    parts = [importlib.import_module(f"PySide6.{name}") for name in PARTS]
    for part in parts:
        for name in dir(part):
            cls = getattr(part, name)
            if isinstance(cls, type) and issubclass(cls, QtCore.QObject) and "staticMetaObject" in dir(cls):
                qt_attributes.patch_class(cls)
    qt_attributes.patch_base()
    QtCore.QTimer.singleShot = staticmethod(_single_shot)
    qt_dialogs.install()

    qt = types.ModuleType("qt", "PythonQt's view of Qt, on PySide6")

    def find(name: str) -> Any:
        for part in parts:
            if hasattr(part, name):
                setattr(qt, name, getattr(part, name))
                return getattr(part, name)
        raise AttributeError(f"the test host's qt has no {name}")

    qt.__getattr__ = find
    sys.modules["qt"] = qt
    from .ui_loader import QUiLoader

    qt.QUiLoader = QUiLoader
    return qt


_waiting: set[QtCore.QTimer] = set()


def _single_shot(milliseconds: int, function: Callable[[], Any]) -> None:
    """PySide6's own goes through ``timer.connect`` in a form that PythonQt does not have."""
    timer = QtCore.QTimer()

    def fire() -> None:
        _waiting.discard(timer)
        function()

    timer.setSingleShot(True)
    timer.timeout.connect(fire)
    _waiting.add(timer)
    timer.start(int(milliseconds))
