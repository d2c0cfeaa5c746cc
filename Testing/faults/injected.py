"""Faults put into a child process: it dies, or the system refuses something, at a chosen moment of its writing."""

from __future__ import annotations

import errno
import os
import resource
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

EVENTS = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir"}
GIVING = {"os.remove", "os.rmdir"}  # a full disk does not refuse these
MEGABYTE = 1 << 20
KINDS = {
    "kill": "kill -9 before the n-th opening, renaming or removing of a file",
    "half": "killed in the middle of a write, at byte n of a file",
    "full": "no space left at the n-th opening, renaming or making",
    "large": "the system refuses byte n of a file, native writers too",
    "disk": "a disk of n bytes in all",
    "interrupt": "Ctrl-C at the n-th opening, renaming or removing of a file",
    "memory": "n bytes of memory left",
    "read-only": "a disk that cannot be written",
    "kill timed": "kill -9 after n seconds of the whole command, computing included",
    "interrupt timed": "Ctrl-C after n seconds of the whole command, computing included",
    "memory, whole": "n bytes of memory left for the whole command, computing included",
    "two at once": "another run of the same command into the same place while the first waits at the n-th event",
}


@dataclass(frozen=True)
class Fault:
    """``at``: n, in the units that KINDS tells."""

    kind: str
    at: float


BLOCKS = (100_000, 10_000, 1000, 300)  # bytes; larger ones are mapped one by one, and given back when freed
_HELD: list[bytes] = []


def arm(fault: Fault, folder: Path) -> None:
    """Make ready for the fault; for the child process, which does not outlive the command. ``folder``: of outputs."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if fault.kind in ("half", "large"):
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL if fault.kind == "half" else signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(fault.at), int(fault.at)))
    elif fault.kind.startswith("memory"):
        _fill_the_heap()
        limit = _address_space() + int(fault.at)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    elif fault.kind in ("kill", "full", "interrupt", "two at once"):
        events = EVENTS - GIVING if fault.kind == "full" else EVENTS
        at_event(folder, int(fault.at), _ACTS[fault.kind], events)


def _fill_the_heap() -> None:
    """Take what was freed before and is still the process's own, which no limit would reach."""
    for size in BLOCKS:
        used = _address_space()
        while _address_space() == used:
            _HELD.extend(bytes(size) for _ in range(50))


def _address_space() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def counter(folder: Path) -> Callable[[], int]:
    """Tells how many file events there were since."""
    count = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        count += event in EVENTS and _writes(event, arguments, str(folder))

    sys.addaudithook(hook)
    return lambda: count


def at_event(folder: Path, number: int, act: Callable[[], None], events: set[str]) -> None:
    """``act`` just before the file event of that number below ``folder``."""
    count = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        if event in events and _writes(event, arguments, str(folder)):
            count += 1
            if count == number:
                act()

    sys.addaudithook(hook)


def _writes(event: str, arguments: tuple[Any, ...], folder: str) -> bool:
    if not isinstance(arguments[0], (str, bytes, os.PathLike)) or not str(arguments[0]).startswith(folder):
        return False
    return event != "open" or bool((arguments[2] or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))


def _full() -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


_ACTS: dict[str, Callable[[], None]] = {
    "kill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "interrupt": lambda: os.kill(os.getpid(), signal.SIGINT),
    "two at once": lambda: os.kill(os.getpid(), signal.SIGSTOP),
    "full": _full,
}
