"""Processor time, wall time and peak memory of named stages of this process."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class StageMeter:
    """``stages``: {name: {"processor_s", "wall_s", "peak_mb"}} in the order they were run.

    peak_mb is the largest resident memory while the stage ran, all that the process holds included; None where the
    system (no Linux) cannot start the count anew.
    """

    def __init__(self) -> None:
        self.stages: dict[str, dict[str, Any]] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Meter the block; the same name again adds its times."""
        resets = _restart_peak()
        wall, processor = time.perf_counter(), time.process_time()
        yield
        spent = {"processor_s": time.process_time() - processor, "wall_s": time.perf_counter() - wall}
        before = self.stages.get(name, {"processor_s": 0.0, "wall_s": 0.0, "peak_mb": 0.0})
        peak = max(_peak_mb(), before["peak_mb"] or 0.0) if resets else None
        self.stages[name] = {**{key: before[key] + value for key, value in spent.items()}, "peak_mb": peak}


def _restart_peak() -> bool:
    """Linux: the peak counts from here on."""
    try:
        CLEAR.write_text("5")
    except OSError:
        return False
    return True


def _peak_mb() -> float:
    found = re.search(r"VmHWM:\s+(\d+) kB", STATUS.read_text(encoding="ascii"))
    return int(found.group(1)) / 1024 if found else 0.0
