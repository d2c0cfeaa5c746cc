"""The ``ctk`` module: the collapsible and numeric widgets, and small stand-ins for the rest."""

from __future__ import annotations

import sys
import types
from typing import Any

from PySide6 import QtGui, QtWidgets
from PySide6.QtCore import Property, Signal

from . import ctk_collapsible, ctk_values  # noqa: F401  (their import registers the stand-ins)
from .record import record
from .stand_in import held, parent_of, row_layout
from .ui_loader import STAND_INS, stand_in


@stand_in
class ctkPathLineEdit(QtWidgets.QWidget):
    currentPathChanged = Signal(str)
    validInputChanged = Signal(bool)
    Dirs, Files, Readable, Writable, Executable = 0x1, 0x2, 0x10, 0x20, 0x40
    filters = held(int, "filters", 0)
    nameFilters = held("QStringList", "nameFilters", [])
    settingKey = held(str, "settingKey", "")
    label = held(str, "label", "")
    showHistoryButton = held(bool, "showHistoryButton", True)

    def __init__(self, *arguments: Any) -> None:
        super().__init__(parent_of(arguments))
        self._edit, browse = QtWidgets.QLineEdit(), QtWidgets.QToolButton()
        browse.setText("...")
        layout = row_layout(self)
        layout.addWidget(self._edit)
        layout.addWidget(browse)
        self._edit.textChanged.connect(self.currentPathChanged)
        browse.clicked.connect(lambda *_: self.browse())

    def setCurrentPath(self, path: str) -> None:
        self._edit.setText(str(path or ""))

    currentPath = Property(str, lambda self: self._edit.text, setCurrentPath)

    def addCurrentPathToHistory(self) -> None:
        """Slicer keeps a history in its settings; nothing to keep here."""

    def browse(self) -> None:
        self.setCurrentPath(record.answer_dialog("ctkPathLineEdit.browse", "", self._edit.text))


@stand_in
class ctkColorPickerButton(QtWidgets.QPushButton):
    colorChanged = Signal(QtGui.QColor)
    color = held(QtGui.QColor, "color", QtGui.QColor(0, 0, 0), signal="colorChanged")
    displayColorName = held(bool, "displayColorName", True)


def _like(name: str, base: type, **properties: tuple[Any, Any]) -> None:
    """A stand-in that is its Qt base with a few properties that hold their value."""

    def init(self: Any, *arguments: Any) -> None:
        base.__init__(self, *[a for a in arguments if a is not None])

    members = {key: held(kind, key, default) for key, (kind, default) in properties.items()}
    stand_in(type(name, (base,), {"__init__": init, **members}))


_like("ctkComboBox", QtWidgets.QComboBox, defaultText=(str, ""))
_like("ctkCheckBox", QtWidgets.QCheckBox)
_like("ctkPushButton", QtWidgets.QPushButton)
_like("ctkMenuButton", QtWidgets.QPushButton)
_like("ctkCheckablePushButton", QtWidgets.QPushButton, checkBoxControlsButton=(bool, True))
_like("ctkExpandableWidget", QtWidgets.QWidget)
_like("ctkFittedTextBrowser", QtWidgets.QTextBrowser, collapsed=(bool, True))
_like(
    "ctkMessageBox",
    QtWidgets.QMessageBox,
    dontShowAgain=(bool, False),
    dontShowAgainVisible=(bool, False),
    dontShowAgainSettingsKey=(str, ""),
)


def install() -> types.ModuleType:
    ctk = types.ModuleType("ctk", "stand-ins for CTK")
    for name, cls in STAND_INS.items():
        if name.startswith("ctk"):
            setattr(ctk, name, cls)
    sys.modules["ctk"] = ctk
    return ctk
