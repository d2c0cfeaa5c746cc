"""The host: loads modules as Slicer does, shows their panels, takes pictures, clears the scene."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import slicer

from . import application, event_loop, mrml_place_widget, mrml_segment_selector  # noqa: F401  (register stand-ins)
from .latency import latency_meter
from .modules import qSlicerScriptedLoadableModule, qSlicerScriptedLoadableModuleWidget
from .record import Record, record

PANEL_WIDTH = 420


@dataclass
class LoadedModule:
    """A module as Slicer holds it: ``instance``, ``widget`` and ``panel`` (the Qt widget of its panel)."""

    name: str
    python: Any
    instance: Any
    widget: Any
    panel: Any

    @property
    def ui(self) -> Any:
        return self.widget.ui

    @property
    def logic(self) -> Any:
        return self.widget.logic


class Host:
    wait = staticmethod(event_loop.wait)
    wait_until = staticmethod(event_loop.wait_until)
    latency_meter = staticmethod(latency_meter)

    def __init__(self) -> None:
        self.app = application.install()
        self.app.layoutManager().threeDWidget(0)  # it is there before any node, as in Slicer
        self.modules: dict[str, LoadedModule] = {}

    @property
    def record(self) -> Record:
        return record

    def process(self, turns: int = 3) -> None:
        """A few turns of the event loop."""
        for _ in range(turns):
            event_loop.process_events()

    def load(self, path: str | Path) -> LoadedModule:
        """Import a module's file and build its panel, as Slicer does at start-up; once per process."""
        path = Path(path).resolve()
        if path.stem not in self.modules:
            self.modules[path.stem] = self._load(path.stem, path)
        return self.modules[path.stem]

    def _load(self, name: str, path: Path) -> LoadedModule:
        python = import_module(name, path)
        parent = qSlicerScriptedLoadableModule(name, str(path))
        self.app.add_module(name, parent)
        instance = getattr(python, name)(parent)
        setattr(slicer.modules, name + "Instance", instance)
        if hasattr(python, name + "FileReader"):
            self.app.coreIOManager().add_scripted_reader(getattr(python, name + "FileReader"))
        self.app.startupCompleted.emit()
        return self.show(LoadedModule(name, python, instance, None, None))

    def show(self, module: LoadedModule) -> LoadedModule:
        """A new panel for the module, entered as when the user chooses the module."""
        panel = qSlicerScriptedLoadableModuleWidget()
        panel.setMRMLScene(slicer.mrmlScene)
        module.widget = getattr(module.python, module.name + "Widget")(panel)
        module.panel = panel
        panel._widget = module.widget
        slicer.modules.__dict__[module.name.lower()]._panel = panel
        setattr(slicer.modules, module.name + "Widget", module.widget)
        module.widget.setup()
        panel.resize(PANEL_WIDTH, 700)
        panel.show()
        panel.enter()
        self.process()
        return module

    def close(self, module: LoadedModule) -> None:
        """Leave the panel and delete it, as at Slicer's exit or on Reload."""
        module.panel.exit()
        module.widget.cleanup()
        module.panel.hide()
        module.panel.deleteLater()
        module.widget = module.panel = None
        self.process()

    def screenshot(self, widget: Any, path: str | Path, width: int = PANEL_WIDTH) -> None:
        """A picture of a widget at its full height, e.g. a whole panel without its scroll bar."""
        self.process()
        layout = widget.layout()
        height = layout.totalHeightForWidth(width) if layout.hasHeightForWidth() else layout.totalSizeHint().height()
        widget.resize(width, max(100, height))
        self.process()
        if not widget.grab().save(str(path)):
            raise RuntimeError(f"cannot write {path}")

    def remove_files(self) -> None:
        """Remove the temporary folder; the last thing before the process ends."""
        shutil.rmtree(self.app.temporaryPath, ignore_errors=True)

    def clear_scene(self) -> None:
        slicer.mrmlScene.Clear(0)
        self.process()


def import_module(name: str, path: Path) -> Any:
    """Import ``path`` as the top-level module ``name``, its folder on sys.path, as Slicer does."""
    if str(path.parent) not in sys.path:
        sys.path.insert(0, str(path.parent))
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
