"""The one run that may be under way, the warm child behind it, and the way back from finished runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import slicer

from organphys.ground.checks import InputError

from ..outputs.case_record import CaseNodes
from ..outputs.undo import RunUndo
from .registration_run import RegistrationRun
from .run_callbacks import RunCallbacks
from .run_inputs import RunInputs
from .run_process import RunProcess
from .warm_session import WarmSession

KEPT_UNDOS = 5
BUSY = "A registration is running: wait for it or press Cancel."


class RunManager:
    """``process``: the child, for tests. InputError where something is asked for that is not possible now."""

    def __init__(self, process: RunProcess | None = None) -> None:
        self._session = WarmSession(process or RunProcess())
        self._undos: list[tuple[CaseNodes, RunUndo]] = []
        self.run: RegistrationRun | None = None
        self._slot = self.stop  # PythonQt keeps no reference to a bound method
        slicer.app.connect("aboutToQuit()", self._slot)

    @property
    def busy(self) -> bool:
        """Whether a run is under way, its cancelling and its transforms included."""
        return self.run is not None and not self.run.finished

    def warm_up(self) -> None:
        """Start the child, so that the first run need not wait for it."""
        self._session.process.start()

    def start(
        self, inputs: RunInputs, stages: Sequence[str], callbacks: RunCallbacks, *, start: Any = None
    ) -> RegistrationRun:
        """A new run, the only one."""
        if self.busy:
            raise InputError(BUSY)
        self.run = RegistrationRun(self._session, inputs, stages, callbacks, start=start, on_end=self._run_ended)
        return self.run

    def remember(self, case: CaseNodes, undo: RunUndo) -> None:
        """Keep the way back from a run that was written."""
        self._undos = [*self._possible(), (case, undo)][-KEPT_UNDOS:]

    def undo(self) -> CaseNodes | None:
        """Take back what the last finished run wrote; the case as it was before, None if the run had made it."""
        if self.busy:
            raise InputError(BUSY)
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
        run, self.run = self.run, None
        if run is not None:
            run.cancel()
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
