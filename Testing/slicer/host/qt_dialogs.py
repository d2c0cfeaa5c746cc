"""Modal dialogs never block: they are recorded and answered (``record.answers``, else accepted or cancelled)."""

from __future__ import annotations

from typing import Any

from PySide6 import QtCore, QtGui, QtWidgets

from .record import record

# Static functions that ask, and what they answer when nobody is there.
CANCELLED_FILES = {"getOpenFileName": "", "getSaveFileName": "", "getExistingDirectory": "", "getOpenFileNames": []}
CANCELLED_INPUTS = {"getText": "", "getInt": 0, "getDouble": 0.0, "getItem": ""}
MESSAGES = ("information", "warning", "critical", "question", "about")


def install() -> None:
    box = QtWidgets.QMessageBox
    QtWidgets.QDialog.exec = QtWidgets.QDialog.exec_ = _answer
    box.exec = box.exec_ = _answer
    for name, value in CANCELLED_FILES.items():
        setattr(QtWidgets.QFileDialog, name, _canned(f"QFileDialog.{name}", value))
    for name, value in CANCELLED_INPUTS.items():
        setattr(QtWidgets.QInputDialog, name, _canned(f"QInputDialog.{name}", value))
    for name in MESSAGES:
        setattr(box, name, _canned(f"QMessageBox.{name}", box.StandardButton.Ok))
    QtGui.QDesktopServices.openUrl = staticmethod(_canned("QDesktopServices.openUrl", True).__func__)


def _answer(dialog: QtWidgets.QDialog) -> Any:
    text, default = QtCore.QObject.property(dialog, "windowTitle"), 1
    if isinstance(dialog, QtWidgets.QMessageBox):
        text, default = QtCore.QObject.property(dialog, "text"), _default_button(dialog)
    return record.answer_dialog(type(dialog).__name__, text, default)


def _default_button(dialog: QtWidgets.QMessageBox) -> int:
    chosen = dialog.defaultButton()
    if chosen is not None:
        return dialog.standardButton(chosen).value
    offered = QtCore.QObject.property(dialog, "standardButtons")
    offered = getattr(offered, "value", offered) or 0
    kinds = QtWidgets.QMessageBox.StandardButton
    return next((b.value for b in (kinds.Ok, kinds.Yes) if offered & b.value), kinds.Ok.value)


def _canned(label: str, default: Any) -> staticmethod:
    def ask(*arguments: Any, **_options: Any) -> Any:
        return record.answer_dialog(label, " | ".join(str(a) for a in arguments[1:3]), default)

    return staticmethod(ask)
