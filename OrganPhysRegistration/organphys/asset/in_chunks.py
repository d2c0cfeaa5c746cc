"""Work on many points in chunks of bounded memory, on several threads."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

MOST_THREADS = 2  # each holds the arrays of a chunk


def in_chunks(count: int, size: int, work: Callable[[slice], None]) -> None:
    """``work`` on every slice of at most ``size`` out of ``count``; slices must not share what they write."""
    parts = [slice(start, start + size) for start in range(0, count, size)]
    if len(parts) < 2:
        for part in parts:
            work(part)
        return
    with ThreadPoolExecutor(min(os.cpu_count() or 1, MOST_THREADS, len(parts))) as pool:
        list(pool.map(work, parts))
