"""``slicer.app``, ``slicer.modules``, ``slicer.mrmlScene`` and the rest that Slicer adds to the ``slicer`` package."""

from __future__ import annotations

import importlib
import sys
import types
from pathlib import Path
from typing import Any

import slicer
import vtk
from PySide6 import QtCore, QtGui, QtWidgets
from PySide6.QtCore import Signal

from . import event_loop, mrml_scene, mrml_widget, sample_data
from .file_io import IOManager
from .hierarchy_items import HierarchyItems
from .layout_manager import LayoutManager
from .modules import BuiltInModule, ModuleManager, qSlicerScriptedLoadableModule
from .record import record

FONT = "DejaVu Sans"


class SlicerApplication(QtWidgets.QApplication):
    startupCompleted = Signal()
    mrmlSceneChanged = Signal(object)
    lastWindowClosed_ = Signal()

    def __init__(self, core: mrml_scene.Core) -> None:
        super().__init__(["organphys-test-host"])
        QtCore.QCoreApplication.setApplicationName("Slicer")
        QtCore.QCoreApplication.setOrganizationName("OrganPhysTestHost")
        QtCore.QSettings.setDefaultFormat(QtCore.QSettings.IniFormat)
        QtCore.QSettings.setPath(QtCore.QSettings.IniFormat, QtCore.QSettings.UserScope, core.folder)
        self._core, self._loaded, self._layout = core, {}, None
        self._io, self._manager, self._items = IOManager(core), ModuleManager(self._loaded), HierarchyItems(core.scene)
        self.__dict__.update(
            temporaryPath=core.folder, slicerHome=core.folder, defaultScenePath=core.folder, majorVersion=5,
            minorVersion=12, extensionsInstallPath=core.folder, installed=True, mainApplicationName="Slicer",
        )  # fmt: skip
        for name, logic in core.logics.items():
            self.add_module(name, BuiltInModule(name, logic))

    def add_module(self, name: str, module: Any) -> None:
        self._loaded[name] = module
        setattr(slicer.modules, name.lower(), module)
        setattr(slicer.moduleNames, name, name)

    def mrmlScene(self) -> Any:
        return self._core.scene

    def applicationLogic(self) -> Any:
        return self._core.app_logic

    def coreIOManager(self) -> IOManager:
        return self._io

    ioManager = coreIOManager

    def moduleManager(self) -> ModuleManager:
        return self._manager

    def moduleLogic(self, name: str) -> Any:
        return self._core.logics.get(name)

    def layoutManager(self) -> LayoutManager:
        if self._layout is None:
            self._layout = LayoutManager(self._core)
        return self._layout

    def settings(self) -> QtCore.QSettings:
        return QtCore.QSettings()

    userSettings = revisionUserSettings = settings

    def testingEnabled(self) -> bool:
        return True

    def mainWindow(self) -> None:
        return None

    def commandOptions(self) -> Any:
        return types.SimpleNamespace(noMainWindow=True, testingEnabled=True)

    def pauseRender(self) -> None:
        """Views render only when asked to."""

    resumeRender = pauseRender


def install() -> SlicerApplication:
    """Fill the ``slicer`` package, as the application does before it loads modules."""
    for name in ("modules", "moduleNames"):
        setattr(slicer, name, types.ModuleType(f"slicer.{name}"))
        sys.modules[f"slicer.{name}"] = getattr(slicer, name)
    core = mrml_scene.build()
    slicer.mrmlScene = core.scene
    slicer.selfTests = {}
    slicer.__path__.append(str(Path(__file__).parent / "base" / "slicer"))
    app = slicer.app = SlicerApplication(core)
    slicer.qSlicerScriptedLoadableModule = qSlicerScriptedLoadableModule
    mrml_widget.install()
    QtWidgets.QApplication.setStyle("Fusion")
    QtWidgets.QApplication.setFont(QtGui.QFont(FONT, 9))
    QtCore.QCoreApplication.processEvents = staticmethod(event_loop.process_events)
    QtCore.QEventLoop.exec = QtCore.QEventLoop.exec_ = event_loop.run_loop
    _quiet_utilities()
    sample_data.install()
    _watch_vtk_errors(app)
    return app


def _quiet_utilities() -> None:
    """Message boxes and installs are recorded; in test mode Slicer answers every message box with OK."""
    util = importlib.import_module("slicer.util")

    def message_box(text: str, parent: Any = None, **_options: Any) -> Any:
        return record.answer_dialog("slicer.util.messageBox", text, QtWidgets.QMessageBox.StandardButton.Ok)

    def pip_install(requirements: Any, *_arguments: Any, **_options: Any) -> None:
        record.pip_requests.append(str(requirements))

    util.messageBox = message_box
    util.delayDisplay = lambda *_arguments, **_options: event_loop.process_events()
    util.pip_install = pip_install


def _watch_vtk_errors(app: SlicerApplication) -> None:
    def on_error(_window: Any, _event: str, text: str = "") -> None:
        record.vtk_errors.append(str(text).strip())

    on_error.CallDataType = vtk.VTK_STRING
    vtk.vtkOutputWindow.GetInstance().AddObserver("ErrorEvent", on_error)
