"""QUiLoader that builds the stand-ins of qMRML*, qSlicer* and ctk* classes and makes the .ui file's connections."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

from PySide6 import QtCore, QtUiTools, QtWidgets

from . import qt_attributes

STAND_INS: dict[str, type] = {}  # class name in a .ui file -> Python class


def stand_in(cls: type) -> type:
    """Class decorator: this class stands in for the C++ class of the same name."""
    STAND_INS[cls.__name__] = cls
    return cls


class QUiLoader(QtUiTools.QUiLoader):
    def createWidget(self, className: str, parent: Any = None, name: str = "") -> QtWidgets.QWidget:
        if className in STAND_INS:
            widget = STAND_INS[className](parent)
            widget.setObjectName(name)
            return widget
        if className in self._custom:
            raise RuntimeError(f"the test host has no stand-in for {className} (widget '{name}')")
        return super().createWidget(className, parent, name)

    def load(self, source: Any, parent: Any = None) -> QtWidgets.QWidget:
        root = ET.fromstring(_content(source))
        self._custom = {c.findtext("class") for c in root.iter("customwidget")}
        parts = ("sender", "signal", "receiver", "slot")
        connections = [tuple(c.findtext(p) for p in parts) for c in root.iter("connection")]
        for element in root.findall("connections"):
            root.remove(element)
        widget = self._built(root, parent)
        named = {w.objectName: w for w in [widget, *widget.findChildren(QtCore.QObject)] if w.objectName}
        for sender, signal, receiver, slot in connections:
            named[sender].connect(signal, getattr(named[receiver], slot.partition("(")[0]))
        return widget

    def _built(self, root: ET.Element, parent: Any) -> QtWidgets.QWidget:
        buffer = QtCore.QBuffer()
        buffer.setData(QtCore.QByteArray(ET.tostring(root)))
        buffer.open(QtCore.QIODevice.ReadOnly)
        qt_attributes.loading_ui = True
        try:
            widget = super().load(buffer, parent)
        finally:
            qt_attributes.loading_ui = False
        if widget is None:
            raise RuntimeError(f"QUiLoader failed: {self.errorString()}")
        self._top = widget
        return widget


def _content(source: Any) -> bytes:
    if isinstance(source, str):
        with open(source, "rb") as stream:
            return stream.read()
    if not source.isOpen():
        source.open(QtCore.QIODevice.ReadOnly)
    return bytes(source.readAll())
