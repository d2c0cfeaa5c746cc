"""Pieces of work on Gaussians shared out among a few threads, which are kept from frame to frame."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

from .splat_grid import in_a_row

THREADS = min(os.cpu_count() or 1, 4)


def in_threads(work: Callable[[int], None], count: int) -> None:
    """Does pieces 0 to ``count`` - 1, in no order; numpy lets other threads run while it calculates."""
    if THREADS == 1 or count < 2:
        in_a_row(work, count)
    else:
        list(_pool(THREADS).map(work, range(count)))


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="splat")
