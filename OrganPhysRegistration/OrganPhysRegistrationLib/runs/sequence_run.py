"""Following an organ through a folder of splats in the registration process; the result becomes sequence nodes."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from organphys.ground.checks import InputError

from ..outputs.sequence_nodes import SequenceNodes, check_sequences, sequence_steps
from .case_files import SavedCase, save_case_steps
from .input_problems import sentence
from .run_callbacks import nothing
from .run_inputs import RunInputs
from .run_process import Event
from .stepped_work import SteppedWork
from .warm_session import WarmSession


@dataclass(frozen=True)
class SequenceCallbacks:
    """All on the main thread. progress(fraction 0..1); done(SequenceNodes); failed(code, message)."""

    progress: Callable[[float], None] = nothing
    done: Callable[[SequenceNodes], None] = nothing
    failed: Callable[[str, str], None] = nothing


class SequenceRun:
    """preparing -> running -> writing -> finished. ``file``: the .organphys-seq in the shared folder, once finished."""

    def __init__(
        self, session: WarmSession, inputs: RunInputs, source: str, fps: float | None, callbacks: SequenceCallbacks
    ) -> None:
        check_sequences()
        self.inputs, self.state = inputs, "preparing"
        self.nodes: SequenceNodes | None = None
        self.file: Path | None = None
        self._session, self._source, self._fps, self._tell = session, source, fps, callbacks
        self._begin(save_case_steps(inputs, session.process.start()), self._prepared)

    @property
    def finished(self) -> bool:
        return self.state == "finished"

    def cancel(self) -> None:
        """Give it up; ``failed`` follows, code "cancelled"."""
        if not self.finished:
            self._work.stop()
            self._end("cancelled", "Following was cancelled.")
            self._session.process.cancel()

    def _begin(self, steps: Any, on_done: Callable[[Any], None]) -> None:
        self._work = SteppedWork(steps, on_done=on_done, on_error=self._step_failed)

    def _prepared(self, saved: SavedCase) -> None:
        self.state = "running"
        self._session.forget()  # the child's case is this one from now on, and nothing of it is registered
        self._session.process.request("load", self._loaded, case=saved.file)

    def _loaded(self, event: Event) -> None:
        if self._goes_on(event):
            self._session.process.request("follow", self._followed, splats=self._source, fps=self._fps)

    def _followed(self, event: Event) -> None:
        if event["event"] == "progress":
            self._tell.progress(float(event.get("fraction", 0.0)))
        elif self._goes_on(event):
            self.state, folder = "writing", self._session.folder / event["sequence"]
            self.file = folder / "organ.organphys-seq"
            segment = self.inputs.segmentation.GetSegmentation().GetSegment(self.inputs.segment_id)
            name = segment.GetName() if segment is not None else "Organ"
            self._begin(sequence_steps(folder, self.inputs.splat, name), self._written)

    def _goes_on(self, event: Event) -> bool:
        """Whether a request is done; its failure ends the run."""
        if event["event"] == "failed" and not self.finished:
            self._end(str(event.get("code", "internal")), sentence(str(event.get("message", ""))))
        return event["event"] == "done" and not self.finished

    def _written(self, nodes: SequenceNodes) -> None:
        self.nodes, self.state = nodes, "finished"
        self._tell.done(nodes)

    def _step_failed(self, error: Exception) -> None:
        if not isinstance(error, InputError):
            logging.error("OrganPhys: following failed", exc_info=error)
        self._end("input" if isinstance(error, InputError) else "internal", sentence(str(error)))

    def _end(self, code: str, message: str) -> None:
        self.state = "finished"
        self._tell.failed(code, message)
