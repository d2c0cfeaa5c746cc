"""The one run that may be under way, the warm child behind it, and the way back from finished runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import slicer

from organphys.ground.checks import InputError
from organphys.points.point_sets import Landmarks

from ..inputs.splat_landmarks import case_landmarks, same_places
from ..outputs.case_nodes import case_of
from ..outputs.case_record import CaseNodes
from ..outputs.undo import RunUndo
from .live_updates import LiveCallbacks, LiveUpdates
from .registration_run import RegistrationRun
from .run_callbacks import RunCallbacks
from .run_inputs import RunInputs
from .run_process import RunProcess
from .sequence_run import SequenceCallbacks, SequenceRun
from .warm_session import WarmSession

KEPT_UNDOS = 5
NOT_REGISTERED = "Live update: register this organ with these settings first, then switch it on."
STOPPING = "Live update is just stopping: try again in a moment."
BUSY = "A registration is running: wait for it or press Cancel."


class RunManager:
    """``process``: the child, for tests. InputError where something is asked for that is not possible now."""

    def __init__(self, process: RunProcess | None = None) -> None:
        self._session = WarmSession(process or RunProcess())
        self._undos: list[tuple[CaseNodes, RunUndo]] = []
        self.run: RegistrationRun | None = None
        self.live: LiveUpdates | None = None
        self.sequence: SequenceRun | None = None
        self._registered: RunInputs | None = None
        self._landmarks: Landmarks | None = None  # of the run that was registered
        self._slot = self.stop  # PythonQt keeps no reference to a bound method
        slicer.app.connect("aboutToQuit()", self._slot)

    @property
    def busy(self) -> bool:
        """Whether a run is under way, its cancelling and its transforms included."""
        return any(run is not None and not run.finished for run in (self.run, self.sequence))

    def warm_up(self) -> None:
        """Start the child, so that the first run need not wait for it."""
        self._session.process.start()

    def start(
        self, inputs: RunInputs, stages: Sequence[str], callbacks: RunCallbacks, *, start: Any = None
    ) -> RegistrationRun:
        """A new run, the only one."""
        if self.busy:
            raise InputError(BUSY)
        self.stop_live()
        if self._session.process.busy:
            raise InputError(STOPPING)
        self.run = RegistrationRun(self._session, inputs, stages, callbacks, start=start, on_end=self._run_ended)
        return self.run

    def start_sequence(
        self, inputs: RunInputs, source: str, fps: float | None, callbacks: SequenceCallbacks
    ) -> SequenceRun:
        """Follow the organ through the splats of ``source``."""
        if self.busy:
            raise InputError(BUSY)
        self.stop_live()
        if self._session.process.busy:
            raise InputError(STOPPING)
        self.sequence = SequenceRun(self._session, inputs, source, fps, callbacks)
        return self.sequence

    def start_live(self, inputs: RunInputs, callbacks: LiveCallbacks) -> LiveUpdates:
        """Live updates of the organ that was registered last, by this process's child."""
        case = case_of(inputs.segmentation, inputs.segment_id, inputs.splat)
        if self.busy:
            raise InputError(BUSY)
        if inputs.method != "organphys":
            raise InputError("Live update: only the method OrganPhys is quick enough; choose it and press Register.")
        if case is None or not self._session.registered or not _same(inputs, self._registered):
            raise InputError(NOT_REGISTERED)
        if not same_places(self._landmarks, case_landmarks(inputs.landmarks, inputs.splat_landmarks, inputs.splat)):
            raise InputError(NOT_REGISTERED)
        self.stop_live()
        self.live = LiveUpdates(self._session, inputs, case, callbacks)
        return self.live

    def stop_live(self) -> None:
        """End live updates, if they are on; they can be undone as one run."""
        live, self.live = self.live, None
        if live is not None:
            live.stop()
            if live.undo is not None:
                self.remember(live.case, live.undo)

    def remember(self, case: CaseNodes, undo: RunUndo) -> None:
        """Keep the way back from a run that was written."""
        self._undos = [*self._possible(), (case, undo)][-KEPT_UNDOS:]

    def undo(self) -> CaseNodes | None:
        """Take back what the last finished run wrote; the case as it was before, None if the run had made it."""
        if self.busy:
            raise InputError(BUSY)
        self.stop_live()
        possible = self._possible()
        if not possible:
            raise InputError("There is no run to undo.")
        case, undo = possible.pop()
        self._undos = possible
        undo.undo()
        return CaseNodes.find(case.scene, case.case_id)

    @property
    def can_undo(self) -> bool:
        """Whether ``undo`` has something to take back."""
        return not self.busy and bool(self._possible())

    def stop(self) -> None:
        """Give up a run without waiting or telling, and end the child."""
        self.stop_live()
        run, self.run = self.run, None
        if run is not None:
            run.cancel()
        if self.sequence is not None:
            self.sequence.cancel()
        self._session.process.stop()

    def close(self) -> None:
        """``stop``, for good."""
        slicer.app.disconnect("aboutToQuit()", self._slot)
        self.stop()

    def _possible(self) -> list[tuple[CaseNodes, RunUndo]]:
        return [(case, undo) for case, undo in self._undos if undo.possible]

    def _run_ended(self, run: RegistrationRun) -> None:
        if run.case is not None and run.undo is not None:
            self.remember(run.case, run.undo)
            self._registered, self._landmarks = run.inputs, run.landmarks


def _same(inputs: RunInputs, registered: RunInputs | None) -> bool:
    """Whether the inputs are those of the last run, but for what a live update may change."""
    if registered is None:
        return False
    return replace(inputs, landmarks=None, stiffness="") == replace(registered, landmarks=None, stiffness="")
