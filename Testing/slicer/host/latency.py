"""How long the event loop was blocked, and where."""

from __future__ import annotations

import faulthandler
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from PySide6 import QtCore

TICK_MS = 5


@dataclass
class LatencyMeter:
    """``longest``: seconds between two turns of the event loop, the longest so far; ``turns``: how many were seen.

    ``blocked_at``: tracebacks of the main thread, taken where it had blocked the loop for ``trace_after`` seconds.
    """

    longest: float = 0.0
    turns: int = 0
    blocked_at: str = ""


@contextmanager
def latency_meter(trace_after: float = 0.15) -> Iterator[LatencyMeter]:
    """Measure within a block, while the event loop runs (``wait``, ``wait_until``): a 5 ms timer marks its turns."""
    meter, timer = LatencyMeter(), QtCore.QTimer()
    last = time.monotonic()

    def tick() -> None:
        nonlocal last
        now = time.monotonic()
        meter.longest, meter.turns, last = max(meter.longest, now - last), meter.turns + 1, now
        faulthandler.dump_traceback_later(trace_after, file=traces)  # a C thread: it needs no GIL to look

    timer.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
    timer.timeout.connect(tick)
    with tempfile.TemporaryFile("w+") as traces:
        timer.start(TICK_MS)
        try:
            yield meter
            tick()
        finally:
            timer.stop()
            faulthandler.cancel_dump_traceback_later()
            traces.seek(0)
            meter.blocked_at = traces.read()
