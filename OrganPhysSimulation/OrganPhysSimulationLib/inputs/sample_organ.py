"""The sample case, registered: what a newcomer needs to press Start."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from OrganPhysRegistrationLib.inputs.splat_node import T_shown_scene
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.case_record import CaseNodes
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs

from .organ_input import organ_of
from .suggested_pins import write_pins


class SampleOrgan(NamedTuple):
    """Nodes of the registered sample case: organ, splat, pins at its back."""

    organ: Any
    splat: Any
    pins: Any


def register_sample_organ(*, folder: str | Path | None = None, size: str = "full") -> SampleOrgan:
    """Load and register the sample case here and now, some ten seconds."""
    logic = OrganPhysRegistrationLogic()
    nodes = logic.loadSampleCase(folder=folder, size=size)
    case = logic.register(nodes["segmentation"], nodes["segmentID"], nodes["splat"], landmarksNode=nodes["landmarks"])
    return organ_with_pins(case)


class SampleRun:
    """The same beside Slicer's window. ``on_ready(SampleOrgan)`` or ``on_failed(message)`` is called."""

    def __init__(
        self,
        on_ready: Callable[[SampleOrgan], None],
        on_failed: Callable[[str], None],
        on_progress: Callable[[str, float], None],
    ) -> None:
        self._logic = OrganPhysRegistrationLogic()
        self._on_ready, self._on_failed = on_ready, on_failed
        self._given_up = False
        nodes = self._logic.loadSampleCase()
        inputs = RunInputs(nodes["segmentation"], nodes["segmentID"], nodes["splat"], landmarks=nodes["landmarks"])
        self._run = self._logic.startRun(
            inputs, onProgress=on_progress, onTransform=self._done, onFailed=lambda code, message: self._failed(message)
        )

    def give_up(self) -> None:
        """Cancel it; nobody is told."""
        self._given_up = True
        self._logic.cleanup()

    def _done(self, case: CaseNodes) -> None:
        if not self._given_up:
            self._given_up = True
            self._logic.cleanup()
            self._on_ready(organ_with_pins(case))

    def _failed(self, message: str) -> None:
        if not self._given_up:
            self._given_up = True
            self._logic.cleanup()
            self._on_failed(message)


def organ_with_pins(case: CaseNodes) -> SampleOrgan:
    """The organ, its splat and suggested pins of a case that was registered elastically."""
    node = case.node("volume")
    return SampleOrgan(node, case.splat, write_pins(None, organ_of(node), T_shown_scene(case.splat)))
