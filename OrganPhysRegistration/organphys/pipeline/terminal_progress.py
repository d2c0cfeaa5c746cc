"""Progress of long work on stderr: one line that is rewritten on a terminal, one line per stage elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from ..ground.progress import Progress, no_progress

_WIDTH, _INTERVAL_S = 24, 0.1


class TerminalProgress:
    """Progress callback: ``progress(stage, fraction)``."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._begin = time.perf_counter()
        self._shown = -_INTERVAL_S
        self._stage = ""

    def __call__(self, stage: str, fraction: float) -> None:
        elapsed = time.perf_counter() - self._begin
        new_stage, self._stage = stage != self._stage, stage
        if self._terminal:
            if new_stage or elapsed - self._shown >= _INTERVAL_S:
                self._shown = elapsed
                filled = round(_WIDTH * min(max(fraction, 0.0), 1.0))
                bar = "#" * filled + "." * (_WIDTH - filled)
                self._write(f"\r[{bar}] {elapsed:5.1f} s  {stage}\x1b[K")
        elif new_stage:
            self._write(f"organphys: {elapsed:5.1f} s  {stage}\n")

    def close(self) -> None:
        """Clear the line, so that what follows starts at the margin."""
        if self._terminal and self._stage:
            self._write("\r\x1b[K")

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


@contextmanager
def shown_progress(*, quiet: bool) -> Iterator[Progress]:
    """A progress callback on stderr for the length of the block."""
    if quiet:
        yield no_progress
        return
    progress = TerminalProgress(sys.stderr)
    try:
        yield progress
    finally:
        progress.close()
