"""Records what is shown into Slicer sequences and plays it back: surface, instrument and handle over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import slicer

RECORDING = "OrganPhys.SimulationRecording"


class Recorder:
    """Adds a frame of every node (by its role) to a sequence with each ``add``; ``finish`` gives the browser of them.

    Slicer's sequences make nodes of their own from the recorded ones, so nodes are not looked up by role here.
    """

    def __init__(self, name: str, nodes: Mapping[str, Any]) -> None:
        scene = slicer.mrmlScene
        self._nodes, self._sequences = dict(nodes), {}
        for role, node in nodes.items():
            sequence = scene.AddNewNodeByClass("vtkMRMLSequenceNode", f"{name} {node.GetName()}")
            sequence.SetIndexName("time")
            sequence.SetIndexUnit("s")
            sequence.SetIndexTypeFromString("numeric")
            sequence.SetAttribute(RECORDING, role)
            self._sequences[role] = sequence
        self._name = name

    def add(self, time_s: float) -> None:
        """The nodes as they are now, at ``time_s``."""
        for role, sequence in self._sequences.items():
            node = self._nodes[role]
            if node.GetScene() is not None:
                sequence.SetDataNodeAtValue(node, f"{time_s:.4f}")

    @property
    def frames(self) -> int:
        return int(next(iter(self._sequences.values())).GetNumberOfDataNodes())

    def finish(self) -> Any:
        """The sequence browser of the recording, None if nothing was recorded (nothing stays in the scene then)."""
        scene = slicer.mrmlScene
        if not self.frames:
            for sequence in self._sequences.values():
                scene.RemoveNode(sequence)
            return None
        browser = scene.AddNewNodeByClass("vtkMRMLSequenceBrowserNode", f"{self._name} recording")
        browser.SetAttribute(RECORDING, "browser")
        for role, sequence in self._sequences.items():
            browser.AddSynchronizedSequenceNode(sequence)
            if self._nodes[role].GetScene() is not None:
                browser.AddProxyNode(self._nodes[role], sequence, False)
            browser.SetSaveChanges(sequence, False)
        browser.SetPlaybackRateFps(30)
        return browser


def recordings() -> list[Any]:
    """Browsers of the recordings of the scene, oldest first."""
    browsers = slicer.util.getNodesByClass("vtkMRMLSequenceBrowserNode")
    return [browser for browser in browsers if browser.GetAttribute(RECORDING) == "browser"]


def show_frame(browser: Any, index: int) -> None:
    """Show one recorded frame: the recorded nodes take its content."""
    browser.SetSelectedItemNumber(index)
    slicer.modules.sequences.logic().UpdateProxyNodesFromSequences(browser)


def frame_count(browser: Any) -> int:
    """Recorded frames of a browser."""
    return int(browser.GetNumberOfItems())
