"""Seconds of computing beside Slicer's window: a thread, and a timer that lends it the interpreter.

Slicer's event loop holds Python's lock, so a thread alone would starve; the timer sleeps a little in every turn.
Nothing in the thread may touch the scene or Qt.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import qt

LENT_S = 0.012  # per turn of the event loop
EVERY_MS = 1


class Background:
    """Runs ``work()``; then ``on_done(result)`` or ``on_error(exception)`` on the main thread, neither after ``drop``.

    The thread cannot be stopped: what it computes after ``drop`` is thrown away.
    """

    def __init__(
        self, work: Callable[[], Any], *, on_done: Callable[[Any], None], on_error: Callable[[Exception], None]
    ) -> None:
        self._outcome: list[tuple[Callable[[Any], None], Any]] = []
        self._thread = threading.Thread(target=self._run, args=(work, on_done, on_error), daemon=True)
        self._slot = self._look  # PythonQt keeps no reference to a bound method
        self._timer = qt.QTimer()
        self._timer.setInterval(EVERY_MS)
        self._timer.connect("timeout()", self._slot)
        self._thread.start()
        self._timer.start()

    @property
    def running(self) -> bool:
        """Whether an answer is still to come."""
        return bool(self._timer.active)

    def drop(self) -> None:
        """Nobody waits for the result any more."""
        self._timer.stop()

    def wait(self) -> None:
        """Finish here and now: the callback has been called when this returns."""
        self._thread.join()
        self._look()

    def _run(self, work: Any, on_done: Any, on_error: Any) -> None:
        try:
            self._outcome.append((on_done, work()))
        except Exception as error:
            self._outcome.append((on_error, error))

    def _look(self) -> None:
        if not self.running:
            return
        if not self._outcome:
            time.sleep(LENT_S)
            return
        self._timer.stop()
        tell, what = self._outcome[0]
        tell(what)
