"""What all qMRML widgets share: they observe one scene."""

from __future__ import annotations

from typing import Any

import slicer
from PySide6 import QtWidgets
from PySide6.QtCore import Signal

from .stand_in import parent_of
from .ui_loader import stand_in


class SceneObserver:
    """Mixin: calls ``scene_changed()`` when nodes come or go, not within batches."""

    def start_observing(self) -> None:
        self._scene, self._tags = None, []

    def mrmlScene(self) -> Any:
        return self._scene

    def setMRMLScene(self, scene: Any) -> None:
        if scene is self._scene:
            return
        for tag in self._tags:
            self._scene.RemoveObserver(tag)
        self._scene, self._tags = scene, []
        if scene is not None:
            kinds = ("NodeAdded", "NodeRemoved", "EndClose", "EndBatchProcess", "EndImport", "EndRestore")
            self._tags = [scene.AddObserver(getattr(scene, f"{kind}Event"), self._on_event) for kind in kinds]
        self.scene_changed()
        self.mrmlSceneChanged.emit(scene)

    def _on_event(self, scene: Any, event: str) -> None:
        import shiboken6

        if not shiboken6.isValid(self):  # the C++ widget is gone, its observers are not yet
            return
        if not scene.IsBatchProcessing() or event in ("EndBatchProcessEvent", "EndCloseEvent"):
            self.scene_changed()

    def scene_changed(self) -> None:
        """To be overridden."""


@stand_in
class qMRMLWidget(SceneObserver, QtWidgets.QWidget):
    mrmlSceneChanged = Signal(object)

    def __init__(self, *arguments: Any) -> None:
        QtWidgets.QWidget.__init__(self, parent_of(arguments))
        self.start_observing()


stand_in(type("qSlicerWidget", (qMRMLWidget,), {}))


def install() -> None:
    """Offer every qMRML and qSlicer stand-in as ``slicer.<class>``, as Slicer does."""
    from .ui_loader import STAND_INS

    for name, cls in STAND_INS.items():
        if not name.startswith("ctk"):
            setattr(slicer, name, cls)
