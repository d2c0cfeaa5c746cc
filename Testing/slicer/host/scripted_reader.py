"""File readers that a scripted module brings along (class ``<Module>FileReader``), and how readers compete."""

from __future__ import annotations

import fnmatch
import os
import re
from typing import Any

import slicer
import vtk


def extension_confidence(path: str, extensions: tuple[str, ...]) -> float:
    """Slicer's default rule: 0.5 and 0.01 for each character of the longest matching extension; 0 if none matches."""
    lengths = [len(e) for e in extensions if path.lower().endswith(e)]
    return 0.5 + 0.01 * max(lengths) if lengths else 0.0


class ReaderParent:
    """What a scripted reader finds as ``parent`` (qSlicerScriptedFileReader)."""

    def __init__(self, reader_class: type) -> None:
        self.loadedNodes: list[str] = []
        self._messages = slicer.vtkMRMLMessageCollection()
        self.reader = reader_class(self)

    def mrmlScene(self) -> Any:
        return slicer.mrmlScene

    def userMessages(self) -> Any:
        return self._messages

    def supportedNameFilters(self, path: str) -> list[str]:
        name = os.path.basename(path).lower()
        patterns = [(f, re.search(r"\((.*)\)", f)) for f in self.reader.extensions()]
        return [f for f, found in patterns if any(fnmatch.fnmatch(name, p) for p in (found[1] if found else f).split())]

    def confidence(self, path: str) -> float:
        if hasattr(self.reader, "canLoadFileConfidence"):
            return float(self.reader.canLoadFileConfidence(path))
        if hasattr(self.reader, "canLoadFile"):
            return 0.55 if self.reader.canLoadFile(path) else 0.0
        return 0.55 if self.supportedNameFilters(path) else 0.0

    def load(self, properties: dict[str, Any], loaded: Any, messages: Any) -> bool:
        self.loadedNodes = []
        self._messages.ClearMessages()
        done = bool(self.reader.load(properties))
        for node_id in [self.loadedNodes] if isinstance(self.loadedNodes, str) else self.loadedNodes:
            if loaded is not None:
                loaded.AddItem(slicer.mrmlScene.GetNodeByID(node_id))
        if messages is not None:
            for index in range(self._messages.GetNumberOfMessages()):
                messages.AddMessage(self._messages.GetNthMessageType(index), self._messages.GetNthMessageText(index))
            if not done and not self._messages.GetNumberOfMessages():
                messages.AddMessage(vtk.vtkCommand.ErrorEvent, f"{self.reader.fileType()} failed to load the file")
        return done
