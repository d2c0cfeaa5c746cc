"""The ``ctk`` module: the collapsible and the numeric widgets, and buttons that are like Qt's."""

from __future__ import annotations

import sys
import types

from PySide6 import QtWidgets

from . import ctk_collapsible, ctk_values  # noqa: F401  (their import registers the stand-ins)
from .ui_loader import STAND_INS, stand_in

LIKE_QT = {
    "ctkCheckBox": QtWidgets.QCheckBox,
    "ctkComboBox": QtWidgets.QComboBox,
    "ctkMenuButton": QtWidgets.QPushButton,
    "ctkPushButton": QtWidgets.QPushButton,
}


def install() -> types.ModuleType:
    ctk = types.ModuleType("ctk", "stand-ins for CTK")
    for name, base in LIKE_QT.items():
        stand_in(type(name, (base,), {}))
    for name, cls in STAND_INS.items():
        if name.startswith("ctk"):
            setattr(ctk, name, cls)
    sys.modules["ctk"] = ctk
    return ctk
