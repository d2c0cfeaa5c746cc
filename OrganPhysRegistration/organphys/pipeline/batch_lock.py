"""A lock on a case that the system lifts when its holder dies, however it dies."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..ground.checks import InputError
from ..ground.hidden_folder import try_lock

_PAUSE_S = 0.25


@contextmanager
def case_lock(path: Path, *, wait: bool) -> Iterator[bool]:
    """True for the length of the block if no one else holds the lock file ``path``; else False, or after ``wait`` True.

    The file stays: removing it would let two holders have a lock each. Among machines it holds where their shared file
    system locks files (NFS 4, Lustre with flock, GPFS). InputError where it does not.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        held = _taken(handle, path)
        while wait and not held:
            time.sleep(_PAUSE_S)
            held = _taken(handle, path)
        yield held
    finally:
        os.close(handle)  # lifts the lock


def _taken(handle: int, path: Path) -> bool:
    try:
        return try_lock(handle)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: cannot be locked ({reason}); choose a folder on a file system with locks") from error
