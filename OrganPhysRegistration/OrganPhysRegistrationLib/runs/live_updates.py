"""Registers again while the user drags a landmark or moves the stiffness: the newest wish wins, nothing blocks.

idle -> updating (the child registers, the surface moves) -> idle; after a while without a change settling (the whole
outcome) -> sampling (transform grids) -> idle. A change breaks settling and sampling off, and an update that has only
just begun; one that has gone on for a while is shown first, so that a long drag shows something.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import qt
import slicer

from organphys.ground.checks import InputError
from organphys.points.point_sets import Landmarks

from ..inputs.landmark_list import landmark_points
from ..inputs.splat_landmarks import case_landmarks, same_places
from ..outputs.case_nodes import CaseNodes
from ..outputs.live_case import write_live
from ..outputs.undo import RunUndo, begin_run
from .case_files import outcome_steps
from .input_problems import sentence
from .result_nodes import case_steps, transform_steps
from .run_callbacks import nothing
from .run_inputs import RunInputs
from .run_process import Event
from .stepped_work import SteppedWork, run_at_once
from .warm_session import WarmSession

WAIT_MS, LONGEST_WAIT_S = 50, 0.25  # after the last change; and after the first of many
STILL_MS = 1200
LET_FINISH_S = 0.3
LOST = "The registration process has forgotten this case: press Register, then switch live update on again."
PLACES = (
    "Landmarks on the splat have changed, which live update cannot follow: press Register, then switch live update on "
    "again."
)


@dataclass(frozen=True)
class LiveCallbacks:
    """All on the main thread. updated(case, seconds): the surface has moved; settled(case): all nodes fit it again;
    failed(message): a change could not be used, the last result stays; ended(message): live update is off now."""

    updated: Callable[[Any, float], None] = nothing
    settled: Callable[[Any], None] = nothing
    failed: Callable[[str], None] = nothing
    ended: Callable[[str], None] = nothing


class LiveUpdates:
    """On from the start until ``stop``. ``state``: see the module, "off" in the end; ``undo``: the way back to what was
    before the first update, None if there was none."""

    def __init__(self, session: WarmSession, inputs: RunInputs, case: CaseNodes, callbacks: LiveCallbacks) -> None:
        self.inputs, self.case, self.undo = inputs, case, None
        self.state = "idle"
        self._session, self._process, self._tell = session, session.process, callbacks
        self._generation = self._process.generation
        self._before: RunUndo = begin_run(inputs.segmentation, inputs.segment_id, inputs.splat)
        self._sent = self._changes()
        self._pending, self._prepared_once, self._unsettled = False, False, False
        self._waiting_since, self._began = 0.0, 0.0
        self._work: SteppedWork | None = None
        self._slots = (self._fire, self._settle)  # PythonQt keeps no reference to bound methods
        self._wait, self._still = _timer(WAIT_MS, self._slots[0]), _timer(STILL_MS, self._slots[1])
        self._placed = self._landmarks()
        self._tags = [
            *self._observe(inputs.landmarks, self.touch),
            *self._observe(inputs.splat_landmarks, self.check_places),
        ]
        self._scene_tag = slicer.mrmlScene.AddObserver(slicer.vtkMRMLScene.StartCloseEvent, self._scene_closing)
        session.detached()
        self._ask("preparing", "prepare", self._prepared)

    def set_stiffness(self, stiffness: str | float) -> None:
        """A preset or a number, as of RegisterOptions."""
        self.inputs = replace(self.inputs, stiffness=stiffness)
        self.touch()

    def set_stiffness_if_new(self, stiffness: str | float) -> None:
        """The same; nothing happens where it is the present one."""
        if stiffness != self.inputs.stiffness:
            self.set_stiffness(stiffness)

    def touch(self, *_event: Any) -> None:
        """Something has changed: register again soon."""
        if self.state == "off":
            return
        self._still.stop()
        now = time.monotonic()
        self._waiting_since = self._waiting_since or now
        if now - self._waiting_since < LONGEST_WAIT_S or not self._wait.isActive():
            self._wait.start()

    def check_places(self, *_event: Any) -> bool:
        """Ends the updates, and tells why, where landmarks on the splat have moved, or pair up differently now."""
        if self.state == "off" or self.inputs.splat_landmarks is None:
            return self.state != "off"
        try:
            same = same_places(self._placed, self._landmarks())
        except InputError as error:
            self.stop(sentence(str(error)))
            return False
        if not same:
            self.stop(PLACES)
        return same

    def stop(self, message: str = "") -> None:
        """Off; what is shown stays, what runs is given up."""
        if self.state == "off":
            return
        was, self.state = self.state, "off"
        self._wait.stop()
        self._still.stop()
        for node, tag in self._tags:
            node.RemoveObserver(tag)
        slicer.mrmlScene.RemoveObserver(self._scene_tag)
        self._stop_work()
        if was != "idle":
            self._process.cancel()
        self._tell.ended(message)

    def _landmarks(self) -> Landmarks | None:
        return case_landmarks(self.inputs.landmarks, self.inputs.splat_landmarks, self.inputs.splat)

    def _observe(self, landmarks: Any, slot: Callable[..., Any]) -> list[tuple[Any, int]]:
        if landmarks is None:
            return []
        kind = slicer.vtkMRMLMarkupsNode
        events = (kind.PointModifiedEvent, kind.PointPositionDefinedEvent, kind.PointRemovedEvent)
        return [(landmarks, landmarks.AddObserver(event, slot)) for event in events]

    def _changes(self) -> dict[str, Any]:
        """What the child is told of the inputs as they are now."""
        node = self.inputs.landmarks
        placed = node is not None and node.GetNumberOfDefinedControlPoints() > 0
        points, names = landmark_points(node) if placed else (None, ())
        landmarks = None if points is None else points.tolist()
        return {"landmarks": landmarks, "names": list(names), "stiffness": self.inputs.stiffness}

    def _fire(self) -> None:
        """The user has paused, or gone on for long: ask for the newest state, or as soon as the child is free."""
        self._waiting_since = 0.0
        if self.state == "idle":
            self._update()
            return
        self._pending = True
        if self.state != "updating" or time.monotonic() - self._began < LET_FINISH_S:
            self._stop_work()
            self._process.cancel(self._stopped)

    def _stopped(self) -> None:
        if self.state != "off":
            self.state = "idle"
            self._go_on()

    def _update(self) -> None:
        self._pending = False
        if not self.check_places():
            return
        wanted = self._changes()
        changed = {name: value for name, value in wanted.items() if value != self._sent[name]}
        if "names" in changed or "landmarks" in changed:
            changed |= {name: wanted[name] for name in ("landmarks", "names")}
        if not changed:
            self._go_on()
            return
        self._asked = wanted
        self._ask("updating", "update", self._updated, **changed)

    def _ask(self, state: str, do: str, then: Callable[[Event], None], **fields: Any) -> None:
        if self._process.generation != self._generation or not self._process.running:
            self.stop(LOST)
            return
        self.state, self._began = state, time.monotonic()

        def listener(event: Event) -> None:
            if self.state == state and event["event"] == "done":
                then(event)
            elif event["event"] == "failed":
                self._failed(state, event)

        self._process.request(do, listener, **fields)

    def _prepared(self, _event: Event) -> None:
        self.state, self._prepared_once = "idle", True
        self._go_on()

    def _updated(self, event: Event) -> None:
        self._sent = self._asked
        try:
            write_live(self.case, run_at_once(outcome_steps(self._folder(event))))
        except InputError as error:
            self.state = "idle"
            self.stop(sentence(str(error)))
            return
        self.undo, self.state, self._unsettled = self._before, "idle", True
        self._tell.updated(self.case, time.monotonic() - self._began)
        self._go_on()

    def _go_on(self) -> None:
        if self._pending:
            self._update()
        elif self._unsettled:
            self._still.start()

    def _settle(self) -> None:
        if self.state == "idle" and not self._prepared_once:  # a change broke it off
            self._ask("preparing", "prepare", self._prepared)
        elif self.state == "idle":
            self._ask("settling", "settle", self._settled)

    def _settled(self, event: Event) -> None:
        steps = case_steps(self._folder(event), self.inputs)
        self._begin(steps, lambda _: self._ask("sampling", "grids", self._sampled))

    def _sampled(self, event: Event) -> None:
        self._begin(transform_steps(self._folder(event), self.case), self._all_done)

    def _all_done(self, _nothing: None) -> None:
        self._work, self.state, self._unsettled = None, "idle", False
        self._tell.settled(self.case)

    def _begin(self, steps: Any, on_done: Callable[[Any], None]) -> None:
        self._work = SteppedWork(steps, on_done=on_done, on_error=self._step_failed)

    def _stop_work(self) -> None:
        work, self._work = self._work, None
        if work is not None:
            work.stop()

    def _step_failed(self, error: Exception) -> None:
        if not isinstance(error, InputError):
            logging.error("OrganPhys: live update failed", exc_info=error)
        self.state = "idle"
        self.stop(sentence(str(error) or type(error).__name__))

    def _failed(self, state: str, event: Event) -> None:
        """A cancelled request is followed by ``_stopped``; a change that cannot be used is told, and the next tried."""
        if self.state != state or event.get("code") == "cancelled":
            return
        self.state = "idle"
        message = sentence(str(event.get("message", "")))
        if self._process.generation != self._generation or not self._process.running:
            self.stop(LOST)
        elif event.get("code") == "input":
            self._sent = {**self._sent, **({"landmarks": None} if state == "updating" else {})}
            self._tell.failed(message)
            self._go_on()
        else:
            self.stop(message)

    def _folder(self, event: Event) -> Path:
        return self._session.folder / event["outcome"]

    def _scene_closing(self, *_event: Any) -> None:
        self.stop()


def _timer(milliseconds: int, slot: Callable[[], None]) -> Any:
    timer = qt.QTimer()
    timer.setSingleShot(True)
    timer.setInterval(milliseconds)
    timer.connect("timeout()", slot)
    return timer
