"""Records what is shown into Slicer sequences and plays it back: surface, instrument and handle over time."""

from __future__ import annotations

from typing import Any

import slicer

from ..roles import find

RECORDED = ("surface", "instrument", "tool")
RECORDING = "OrganPhys.SimulationRecording"


class Recorder:
    """Adds a frame to three sequence nodes with every ``add``; ``finish`` gives the browser that plays them."""

    def __init__(self, name: str) -> None:
        scene = slicer.mrmlScene
        self._sequences = {}
        for role in RECORDED:
            sequence = scene.AddNewNodeByClass("vtkMRMLSequenceNode", f"{name} {find(role).GetName()}")
            sequence.SetIndexName("time")
            sequence.SetIndexUnit("s")
            sequence.SetIndexTypeFromString("numeric")
            sequence.SetAttribute(RECORDING, role)
            self._sequences[role] = sequence
        self._name = name

    def add(self, time_s: float) -> None:
        """The nodes as they are now, at ``time_s``."""
        for role, sequence in self._sequences.items():
            node = find(role)
            if node is not None:
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
            browser.AddProxyNode(find(role), sequence, False)
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
