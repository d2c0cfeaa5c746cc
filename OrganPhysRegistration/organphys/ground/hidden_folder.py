"""Hidden folders for what is not finished. Each is locked, and the system lifts the lock when its holder dies.

So a later run tells what another one is still writing from what a dead one has left, and clears the latter.
"""

from __future__ import annotations

import os
import shutil
import sys
from contextlib import suppress
from pathlib import Path

LOCK = "lock"


def claim(folder: Path) -> int | None:
    """The handle of the lock on ``folder``, which is made if it is missing; None while another holder lives.

    What a dead holder has left is still in it. Where the file system has no locks only a new folder can be had, and
    what a dead holder left stays. OSError where the folder cannot be made.
    """
    try:
        folder.mkdir()
        new = True
    except FileExistsError:
        new = False
    try:
        handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    except FileNotFoundError:  # its last holder is just removing it
        return None
    except BaseException:
        if new:
            _remove(folder)
        raise
    if _held(handle, folder / LOCK, new=new):
        return handle
    os.close(handle)
    return None


def release(folder: Path, handle: int) -> None:
    """Remove the folder with all it holds, the lock last, and lift the lock."""
    clear(folder)
    if sys.platform == "win32":  # there an open file cannot be removed
        os.close(handle)
    with suppress(OSError):  # what cannot be removed now is cleared by the next holder
        (folder / LOCK).unlink()
    _remove(folder)
    if sys.platform != "win32":
        os.close(handle)


def clear(folder: Path) -> None:
    """Remove all but the lock."""
    for path in list(folder.iterdir()):
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        elif path.name != LOCK:
            with suppress(OSError):
                path.unlink()


def missing_parents(path: Path) -> list[Path]:
    """Folders above ``path`` that are not there, the innermost first."""
    return [parent for parent in path.parents if not parent.exists()]


def remove_empty(folders: list[Path]) -> None:
    """Remove these folders, the innermost first; one that holds something stays."""
    for folder in folders:
        _remove(folder)


def try_lock(handle: int) -> bool:
    """Whether this process has the lock on the open file now; OSError where the file system has no locks."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):  # the latter on Windows
        return False
    return True


def _held(handle: int, path: Path, *, new: bool) -> bool:
    """Whether the lock is ours, and still that of the folder: its last holder may have removed it meanwhile."""
    try:
        locked = try_lock(handle)
    except OSError:
        return new
    try:
        return locked and os.path.samestat(os.fstat(handle), os.stat(path))
    except OSError:
        return False


def _remove(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()
