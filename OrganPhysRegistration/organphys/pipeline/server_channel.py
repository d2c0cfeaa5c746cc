"""The session server's two ends: requests come as JSON lines on stdin, replies go as JSON lines to stdout.

Nothing but replies ever reaches stdout: what libraries print there goes to stderr.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, BinaryIO

from ..ground.plain_json import plain

LINGER_S = 5.0  # a request that does not notice the end of its client for so long is broken off


@dataclass(frozen=True)
class Request:
    """One line of the client: ``fields`` as sent, ``number``: how many came before it; ``problem``: why it is none."""

    fields: dict[str, Any]
    number: int
    problem: str = ""


class Channel:
    """Reads in a thread of its own, so that a cancel is seen while a request runs."""

    def __init__(self, source: BinaryIO, sink: BinaryIO, on_end: Callable[[], None] = lambda: None) -> None:
        self._source, self._sink, self._on_end = source, sink, on_end
        self._requests: queue.SimpleQueue[Request | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._received, self._cancelled_below = 0, 0
        self._closed = False
        threading.Thread(target=self._read, name="requests", daemon=True).start()

    @classmethod
    def of_this_process(cls) -> Channel:
        """Over stdin and stdout; from now on prints go to stderr."""
        sys.stdout.flush()
        sink = os.fdopen(os.dup(1), "wb", buffering=0)
        os.dup2(2, 1)
        sys.stdout = sys.stderr
        return cls(sys.stdin.buffer, sink, _break_off_later)

    def next(self) -> Request | None:
        """The next request, waited for; None at the end."""
        return self._requests.get()

    def is_cancelled(self, request: Request) -> bool:
        """Whether a cancel, or the end of the client, came after the request."""
        return self._closed or request.number < self._cancelled_below

    def tell(self, **event: Any) -> None:
        """One reply; a client that has gone is noticed by the reading thread."""
        line = json.dumps(plain(event), allow_nan=False) + "\n"
        with self._lock:
            try:
                self._sink.write(line.encode("utf-8"))
            except OSError:
                self._close()

    def _read(self) -> None:
        try:
            for line in self._source:
                if line.strip() and not self._take(_parsed(line, self._received)):
                    break
        finally:  # also where stdin was torn away
            self._close()

    def _take(self, request: Request) -> bool:
        """Whether there may be more after it."""
        do = request.fields.get("do")
        if do == "cancel":
            self._cancelled_below = self._received
        elif do != "quit":
            self._received += 1
            self._requests.put(request)
        return do != "quit"

    def _close(self) -> None:
        """Cancel what runs and what waits, and let ``next`` tell the end."""
        if not self._closed:
            self._closed = True
            self._requests.put(None)
            self._on_end()


def _break_off_later() -> None:
    """Nobody listens any more: what does not notice in time is ended with the process."""
    timer = threading.Timer(LINGER_S, os._exit, (1,))
    timer.daemon = True
    timer.start()


def _parsed(line: bytes, number: int) -> Request:
    try:
        fields = json.loads(line)
    except (ValueError, RecursionError):
        return Request({}, number, f"not JSON: {line[:80].decode('utf-8', errors='replace').strip()}")
    if not isinstance(fields, dict):
        return Request({}, number, "a request must be a JSON object")
    return Request(fields, number)
