"""Stand-ins for ``slicer.modules.*`` and for the C++ side of a scripted module."""

from __future__ import annotations

from typing import Any

import slicer
from PySide6 import QtCore, QtWidgets
from PySide6.QtCore import Signal

from .mrml_widget import qMRMLWidget
from .ui_loader import stand_in


class BuiltInModule:
    """What ``slicer.modules.<name>`` offers of a module of Slicer: its real logic."""

    def __init__(self, name: str, logic: Any) -> None:
        self.name = self.title = name
        self._logic = logic

    def logic(self) -> Any:
        return self._logic


class qSlicerScriptedLoadableModule(QtCore.QObject):
    """The object that a scripted module's first class gets as ``parent``."""

    def __init__(self, name: str, path: str) -> None:
        super().__init__()
        self.__dict__.update(
            title=name, path=path, categories=[], dependencies=[], contributors=[], helpText="", icon=None, index=-1,
            acknowledgementText="", hidden=False, defaultDocumentationLink="", associatedNodeTypes=[],
        )  # fmt: skip
        self.setObjectName(name)
        self._panel = None

    def logic(self) -> Any:
        logic = slicer.vtkSlicerScriptedLoadableModuleLogic()
        logic.SetMRMLScene(slicer.mrmlScene)
        return logic

    def widgetRepresentation(self) -> Any:
        return self._panel


@stand_in
class qSlicerScriptedLoadableModuleWidget(qMRMLWidget):
    """The panel that a scripted module's widget class gets as ``parent``."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self._widget = None
        QtWidgets.QVBoxLayout(self)

    def self(self) -> Any:
        return self._widget

    def enter(self) -> None:
        self._widget.enter()

    def exit(self) -> None:
        self._widget.exit()


class FactoryManager:
    def __init__(self, modules: dict[str, Any]) -> None:
        self._modules = modules

    def loadedModuleNames(self) -> tuple[str, ...]:
        return tuple(self._modules)

    registeredModuleNames = instantiatedModuleNames = loadedModuleNames

    def isLoaded(self, name: str) -> bool:
        return name in self._modules


class ModuleManager(QtCore.QObject):
    moduleAboutToBeUnloaded = Signal(str)
    moduleLoaded = Signal(str)

    def __init__(self, modules: dict[str, Any]) -> None:
        super().__init__()
        self._modules = modules

    def module(self, name: str) -> Any:
        return self._modules.get(name)

    def modulesNames(self) -> tuple[str, ...]:
        return tuple(self._modules)

    def factoryManager(self) -> FactoryManager:
        return FactoryManager(self._modules)
