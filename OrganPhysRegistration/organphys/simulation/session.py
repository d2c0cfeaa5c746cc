"""A running simulation: holds scene and state, steps them, goes back, and records what was done for a replay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from ..ground.checks import InputError, as_positive
from .blas_threads import one_blas_thread
from .body import Body
from .factor import FactorCache
from .local_detail import LocalDetail, prepare
from .local_following import followed
from .options import SimulationOptions
from .pins import AnyPin
from .scene import Scene
from .state import BodyState, SceneState, ToolPose
from .state_transfer import transferred
from .step import StepReport, step


class Snapshot(NamedTuple):
    """Scene and state at one moment; neither ever changes."""

    scene: Scene
    state: SceneState


class Move(NamedTuple):
    """One step of ``dt`` s with the tools going to ``poses``."""

    poses: tuple[ToolPose, ...]
    dt: float


class PinEdit(NamedTuple):
    """The pins of a body, by its number, were exchanged."""

    body: int
    pins: tuple[AnyPin, ...]


Event = Move | PinEdit | SimulationOptions


@dataclass(frozen=True)
class Recording:
    """Where a recording began and all that was done since, in order."""

    start: Snapshot
    events: tuple[Event, ...]
    detail: LocalDetail | None


class Simulation:
    """Scene and state with their past. Same scene, same events: same states, bit for bit on one machine.

    ``detail``: local functions where the tools touch, following them; None: the handles of the bodies alone.
    """

    @one_blas_thread
    def __init__(self, scene: Scene, state: SceneState, *, detail: LocalDetail | None = None) -> None:
        self._first = self._start = Snapshot(scene, state)
        self._now = self._first
        self._events: list[Event] = []
        self._marks: list[tuple[Snapshot, int]] = []
        self._detail = detail
        self._cache = FactorCache()
        if detail is not None:
            for body in scene.bodies:
                prepare(body, detail)

    @property
    def scene(self) -> Scene:
        return self._now.scene

    @property
    def state(self) -> SceneState:
        return self._now.state

    @property
    def snapshot(self) -> Snapshot:
        """The present moment; hand it to ``restore`` to come back."""
        return self._now

    @one_blas_thread
    def step(self, poses: tuple[ToolPose, ...] = (), *, dt: float = 1 / 60) -> StepReport:
        """One step of ``dt`` s with the tools moved to ``poses``; nothing changes if it is refused (InputError)."""
        state, report = step(self.scene, self.state, poses, dt, cache=self._cache)
        self._events.append(Move(state.tools, as_positive(dt, "dt")))
        self._now = Snapshot(self.scene, state)
        if self._detail is not None:
            self._now = _followed(self._now, self._detail)
        return report

    @one_blas_thread
    def set_pins(self, index: int, *pins: AnyPin) -> None:
        """Body ``index`` is held by these pins from now on; it keeps its shape and speed."""
        if not 0 <= index < len(self.scene.bodies):
            raise InputError(f"body: expected a number from 0 to {len(self.scene.bodies) - 1}, got {index}")
        self._now = _repinned(self._now, PinEdit(index, pins))
        self._events.append(PinEdit(index, pins))

    def set_options(self, options: SimulationOptions) -> None:
        """Other options (gravity, damping, friction, ...) from now on."""
        self._now = Snapshot(replace(self.scene, options=options), self.state)
        self._events.append(options)

    def mark(self) -> None:
        """Remember this moment for ``undo``: before a drag, an edit, a run."""
        self._marks.append((self._now, len(self._events)))

    def undo(self) -> None:
        """Back to the last mark, which is forgotten; InputError if there is none."""
        if not self._marks:
            raise InputError("undo: there is nothing to undo")
        self._now, kept = self._marks.pop()
        del self._events[kept:]

    def reset(self) -> None:
        """Back to the beginning; marks and recording start anew."""
        self.restore(self._first)

    def restore(self, snapshot: Snapshot) -> None:
        """Go on from ``snapshot``; marks and recording start anew."""
        self._now = self._start = snapshot
        self._events.clear()
        self._marks.clear()

    def recording(self) -> Recording:
        """What was done since the beginning or the last ``reset`` or ``restore``."""
        return Recording(self._start, tuple(self._events), self._detail)


def replay(recording: Recording) -> list[Snapshot]:
    """All moments of a recording, computed again: the start and one per event."""
    simulation = Simulation(*recording.start, detail=recording.detail)
    moments = [simulation.snapshot]
    for event in recording.events:
        if isinstance(event, Move):
            simulation.step(event.poses, dt=event.dt)
        elif isinstance(event, PinEdit):
            simulation.set_pins(event.body, *event.pins)
        else:
            simulation.set_options(event)
        moments.append(simulation.snapshot)
    return moments


def _repinned(now: Snapshot, edit: PinEdit) -> Snapshot:
    old = now.scene.bodies[edit.body]
    new = old.with_pins(*edit.pins)
    return _with_body(now, edit.body, new, transferred(now.state.bodies[edit.body], old, new))


def _followed(now: Snapshot, detail: LocalDetail) -> Snapshot:
    for index, body in enumerate(now.scene.bodies):
        new, state = followed(body, now.state.bodies[index], detail)
        if new is not body:
            now = _with_body(now, index, new, state)
    return now


def _with_body(now: Snapshot, index: int, body: Body, state: BodyState) -> Snapshot:
    states = (*now.state.bodies[:index], state, *now.state.bodies[index + 1 :])
    return Snapshot(now.scene.with_body(index, body), replace(now.state, bodies=states))
