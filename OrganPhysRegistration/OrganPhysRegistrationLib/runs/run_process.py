"""Client of the registration server: one child process, kept warm between runs, that speaks JSON lines.

Nothing here blocks: requests are written to the child's standard input, its replies arrive with the event loop. A
listener gets every event of its request; the last one is "done" or "failed", also when the child dies.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import qt

from .child_process import ChildProcess
from .child_program import server_arguments

Event = dict[str, Any]
Listener = Callable[[Event], None]

CANCEL_MS = 1500  # a child that has not ended its request by then is killed
START_MS = 120_000  # a cold disk and a virus scanner can make the first import slow
CANCELLED = ("cancelled", "the registration was cancelled")


class RunProcess:
    """The server's child process, started by the first request and again after it has died.

    ``arguments``: folder -> arguments of the Python that is started, for tests; ``ready``: what the child told of
    itself ("organphys": version, "file": path), {} until it has; ``generation``: counts the children, so that a user
    of several requests notices that a child has forgotten the first ones.
    """

    def __init__(self, arguments: Callable[[Path], list[str]] = server_arguments) -> None:
        self._arguments = arguments
        self._child: ChildProcess | None = None
        self._listeners: dict[int, Listener] = {}
        self._last_id = 0
        self._cancelling = False
        self._on_stopped: Callable[[], None] | None = None
        self.generation = 0
        self.ready: Event = {}
        self._slots = (self._start_took_too_long, self._cancel_took_too_long)  # PythonQt keeps no reference to them
        self._start_timer = _single_shot(START_MS, self._slots[0])
        self._cancel_timer = _single_shot(CANCEL_MS, self._slots[1])

    @property
    def running(self) -> bool:
        """Whether a child lives, so that the next request finds it warm."""
        return self._child is not None

    @property
    def busy(self) -> bool:
        """Whether a request has no final answer yet."""
        return bool(self._listeners)

    def start(self) -> Path:
        """Start the child unless it lives; the folder shared with it, removed when it ends."""
        if self._child is None:
            self.ready = {}
            self.generation += 1
            self._child = ChildProcess(self._arguments, on_line=self._read, on_end=self._ended)
            self._start_timer.start()
        return self._child.folder

    def request(self, do: str, listener: Listener, **fields: Any) -> int:
        """Send one request and return its number; ``listener`` is called from the event loop only."""
        self.start()
        self._last_id += 1
        self._listeners[self._last_id] = listener
        self._write({"id": self._last_id, "do": do, **fields})
        return self._last_id

    def cancel(self, on_stopped: Callable[[], None] | None = None) -> None:
        """Ask the child to drop its request; after 1.5 s it is killed. The listener gets "failed", code "cancelled".

        ``on_stopped``: called once nothing is under way any more, at once if nothing is.
        """
        self._on_stopped = on_stopped
        if not self._listeners:
            self._end_cancelling()
        elif not self._cancelling:
            self._cancelling = True
            self._write({"do": "cancel"})
            self._cancel_timer.start()

    def stop(self) -> None:
        """End the child at once, without a word to the listeners."""
        self._listeners.clear()
        self._cancelling, self._on_stopped = False, None
        self._forget_child()

    def _write(self, message: Event) -> None:
        if self._child is not None:
            self._child.write(json.dumps(message))

    def _read(self, line: str) -> None:
        try:
            event = _event(line)
        except ValueError as error:
            logging.error("OrganPhys: the registration process sent %s", error)
            self._fail("internal", "the registration process gave an answer that cannot be read; press Register again")
            return
        if event["event"] == "ready":
            self._become_ready(event)
            return
        number, final = event.get("id"), event["event"] in ("done", "failed")
        listener = self._listeners.pop(number, None) if final else self._listeners.get(number)
        if listener is not None:
            listener(event)
        if final and self._cancelling and not self._listeners:
            self._end_cancelling()

    def _become_ready(self, event: Event) -> None:
        self._start_timer.stop()
        self.ready = event
        if self._child is not None:
            self._child.pid_of_python = int(event.get("pid", 0))
        logging.info("OrganPhys: registration process with organphys %s, %s", event.get("organphys"), event.get("file"))

    def _ended(self, reason: str) -> None:
        what = "ended unexpectedly" if self.ready else "could not start"
        self._fail("internal", f"the registration process {what} ({reason}); press Register to start it again")

    def _start_took_too_long(self) -> None:
        message = f"the registration process was not ready after {START_MS // 1000} s; press Register to start it again"
        self._fail("internal", message)

    def _cancel_took_too_long(self) -> None:
        self._fail(*CANCELLED)

    def _fail(self, code: str, message: str) -> None:
        """End the child and tell every listener why."""
        if self._cancelling:
            code, message = CANCELLED
        listeners, self._listeners = self._listeners, {}
        self._forget_child()
        for number, listener in listeners.items():
            listener({"id": number, "event": "failed", "code": code, "message": message})
        self._end_cancelling()

    def _forget_child(self) -> None:
        self._start_timer.stop()
        self._cancel_timer.stop()
        child, self._child = self._child, None
        if child is not None:
            child.kill()

    def _end_cancelling(self) -> None:
        self._cancelling = False
        self._cancel_timer.stop()
        on_stopped, self._on_stopped = self._on_stopped, None
        if on_stopped is not None:
            on_stopped()


def _event(line: str) -> Event:
    """The event of a line; ValueError for anything else."""
    event = json.loads(line)
    if not isinstance(event, dict) or not isinstance(event.get("event"), str):
        raise ValueError(f"no event: {line[:200]}")
    return event


def _single_shot(milliseconds: int, slot: Callable[[], None]) -> qt.QTimer:
    timer = qt.QTimer()
    timer.setSingleShot(True)
    timer.setInterval(milliseconds)
    timer.connect("timeout()", slot)
    return timer
