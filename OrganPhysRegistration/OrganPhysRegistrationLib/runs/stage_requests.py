"""The talk with the child from "load" to the last stage's outcome."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from organphys.ground.checks import Array

from .case_files import SavedCase
from .progress_share import ProgressShare
from .run_process import Event
from .warm_session import WarmSession

PREPARE, RESULTS = "prepare", "results"


class StageRequests:
    """Requests one stage after the other until all are done or one fails.

    ``on_progress(stage, fraction)``: fraction (0..1) of the whole run; ``on_surface(points (Nv, 3))``: scene units;
    ``on_stage(folder)``: outcome of a stage on the way; ``on_done(folder)``: of the last one; ``on_failed(code,
    message)``. ``give_up``: none of them is called any more.
    """

    def __init__(
        self,
        session: WarmSession,
        *,
        on_progress: Callable[[str, float], None],
        on_surface: Callable[[Array], None],
        on_stage: Callable[[Path], None],
        on_done: Callable[[Path], None],
        on_failed: Callable[[str, str], None],
    ) -> None:
        self._session = session
        self._on_progress, self._on_surface = on_progress, on_surface
        self._on_stage, self._on_done, self._on_failed = on_stage, on_done, on_failed
        self._left: list[str] = []
        self._given_up = False

    def begin(self, saved: SavedCase, stages: Sequence[str], start: Any = None) -> None:
        """``start`` (4, 4) as lists: T_scene_ct set by hand that the first of ``stages`` begins with, None for none."""
        self._saved, self._stages, self._start = saved, tuple(stages), start
        self._left = self._session.plan(saved.digest, stages)
        self._share = ProgressShare([PREPARE, *self._left, RESULTS])
        self._next()

    def report(self, part: str, stage: str, fraction: float) -> None:
        """Progress of a part of the run: PREPARE, a request, RESULTS."""
        self._on_progress(stage, self._share.advance(part, fraction))

    def give_up(self) -> None:
        """Fall silent. A stage that is cancelled leaves the child as it was."""
        self._given_up = True

    def _next(self) -> None:
        do, fields = self._left[0], dict[str, Any]()
        if do == "load":
            self._session.forget()
            fields["case"] = self._saved.file
        elif do == self._stages[0] and self._start is not None:
            fields["start"] = self._start
        self.report(do, do, 0.0)
        self._session.process.request(do, self._on_event, **fields)

    def _on_event(self, event: Event) -> None:
        if self._given_up:
            return
        kind = event["event"]
        if kind == "failed":
            self._session.forget()
            self._on_failed(str(event.get("code", "internal")), str(event.get("message", "")))
        elif kind == "progress":
            self.report(self._left[0], str(event.get("stage", "")), float(event.get("fraction", 0.0)))
        elif kind == "surface":
            file = self._session.folder / event["file"]
            if file.exists():  # else we are late: the child keeps the newest ones only
                self._on_surface(np.load(file))
                file.unlink()
        elif kind == "done":
            self._request_done(self._left.pop(0), event)

    def _request_done(self, done: str, event: Event) -> None:
        if done == "load":
            self._session.loaded(self._saved.digest)
            self._next()
            return
        self._session.finished(done)
        folder = self._session.folder / event["outcome"]
        if self._left:
            self._next()  # the child works on while the stage is shown
            self._on_stage(folder)
        else:
            self._on_done(folder)
