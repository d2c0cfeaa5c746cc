"""How long the event loop was blocked."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from PySide6 import QtCore

TICK_MS = 5


@dataclass
class LatencyMeter:
    """``longest``: seconds between two turns of the event loop, the longest so far; ``turns``: how many were seen.

    Time in which the thread could have run but other processes had the processors does not count: it says how busy the
    machine is, not how long the program keeps its user waiting.
    """

    longest: float = 0.0
    turns: int = 0


@contextmanager
def latency_meter() -> Iterator[LatencyMeter]:
    """Measure within a block, while the event loop runs (``wait``, ``wait_until``): a 5 ms timer marks its turns."""
    meter, timer = LatencyMeter(), QtCore.QTimer()
    last = _own_time()

    def tick() -> None:
        nonlocal last
        now = _own_time()
        meter.longest, meter.turns, last = max(meter.longest, now - last), meter.turns + 1, now

    timer.setTimerType(QtCore.Qt.TimerType.PreciseTimer)
    timer.timeout.connect(tick)
    timer.start(TICK_MS)
    try:
        yield meter
        tick()
    finally:
        timer.stop()


def _own_time() -> float:
    """Seconds on a clock that stands still while this thread waits for a processor."""
    schedule = Path("/proc/thread-self/schedstat")  # ns run, ns waited for a processor, time slices
    waited = int(schedule.read_text().split()[1]) if schedule.exists() else 0
    return time.monotonic() - 1e-9 * waited
