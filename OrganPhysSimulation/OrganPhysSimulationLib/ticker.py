"""Steps a session by a timer: as fast as the wished speed asks for, never longer than a bounded time per turn."""

from __future__ import annotations

import time
from collections.abc import Callable

import qt

from .engine.live_simulation import DT
from .session import SimulationSession

EVERY_MS = 15
BUDGET_S = 0.030  # of steps per turn; one step may exceed it
BACKLOG_S = 0.10  # simulated time that is made up for, the rest is dropped: slower, not jerky
SHOWN_S = 0.033  # between two frames that are shown, at least
SHOWING = 0.5  # part of the time that showing may take: of a large splat fewer frames are shown, the organ goes on


class Ticker:
    """``on_frame()`` after every shown frame; ``on_failed(exception)`` when a step was refused: it has stopped then."""

    def __init__(self, on_frame: Callable[[], None], on_failed: Callable[[Exception], None]) -> None:
        self._on_frame, self._on_failed = on_frame, on_failed
        self._session: SimulationSession | None = None
        self.speed = 1.0
        self._slot = self._turn  # PythonQt keeps no reference to a bound method
        self._timer = qt.QTimer()
        self._timer.setInterval(EVERY_MS)
        self._timer.connect("timeout()", self._slot)
        self._owed = self._last = self._drawn = self._stepped = self._showing = 0.0
        self._unshown = self._last_was_shown = False
        self.pace = 0.0  # simulated seconds per second, smoothed

    @property
    def running(self) -> bool:
        return self._session is not None

    def start(self, session: SimulationSession) -> None:
        """Step this session from now on."""
        self._session, self._owed, self.pace = session, 0.0, self.speed
        self._last = self._drawn = self._stepped = time.perf_counter()
        self._unshown = self._last_was_shown = False
        self._showing = 0.0
        self._timer.start()

    def stop(self) -> None:
        """No more steps; what is shown is the last state."""
        self._timer.stop()
        session, self._session = self._session, None
        if session is not None:
            session.publish()

    def abandon(self) -> None:
        """Stop without touching the scene, which is about to go."""
        self._timer.stop()
        self._session = None

    def _turn(self) -> None:
        session = self._session
        if session is None:
            return
        try:
            self._advance(session)
        except Exception as error:
            self.abandon()
            self._on_failed(error)

    def _advance(self, session: SimulationSession) -> None:
        now = time.perf_counter()
        passed, self._last = now - self._last, now
        self._owed = min(self._owed + passed * self.speed, max(BACKLOG_S, DT))
        if self._last_was_shown:  # publishing, and the views that were drawn since
            self._showing, self._last_was_shown = passed, False
        if self._unshown and now - self._drawn >= max(SHOWN_S, self._showing / SHOWING):  # a turn of its own: shorter
            self._drawn, self._unshown, self._last_was_shown = now, False, True
            session.publish()
            self._on_frame()
            return
        done = 0
        while self._owed >= DT and time.perf_counter() - now < BUDGET_S:
            session.step()
            self._owed -= DT
            done += 1
        self._unshown = self._unshown or done > 0
        since = now - self._stepped
        self._stepped = now
        self.pace += min(1.0, since / 0.5) * (done * DT / max(since, 1e-6) - self.pace)
