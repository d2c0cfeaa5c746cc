"""Files that are either whole or not there: written in a hidden folder beside the target, then renamed onto it."""

from __future__ import annotations

import errno
import itertools
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .checks import InputError
from .hidden_folder import claim, clear, missing_parents, release, remove_empty
from .interrupts import interrupts_held

_FULL = {errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)}
_BLOCK = 4096  # bytes that no file system keeps elsewhere than in the files


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Path of the same name beside ``path``; it replaces ``path`` when the block ends without an exception.

    On any exception (Ctrl-C too) all that was written is removed and ``path`` stays as it was; what a killed process
    left is removed when ``path`` is written again. The folder is made if it is missing. InputError where it cannot be
    made, or the disk refuses what is written.
    """
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{target}: this is a folder; name a file inside it")
    made = missing_parents(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        folder, handle = _hidden(target)
    except OSError as error:
        remove_empty(made)
        raise unwritable(target, error) from error
    try:
        temporary = folder / target.name
        yield temporary
        os.write(handle, bytes(_BLOCK))  # some writers do not notice that the disk is full; this does
        os.replace(temporary, target)
    except OSError as error:
        if error.filename not in (None, str(temporary)):
            raise  # another file's: the block reads or writes that too
        raise unwritable(target, error) from error
    finally:
        with interrupts_held():
            release(folder, handle)
            remove_empty(made)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Text as UTF-8 with LF line ends, atomically."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Bytes, atomically; InputError where the disk refuses them."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def unwritable(target: Path, error: OSError) -> InputError:
    """What to tell when the system refuses to write ``target``."""
    reason = error.strerror or str(error)
    if error.errno in _FULL:
        return InputError(f"{target}: cannot be written ({reason}); make room there or choose another output folder")
    return InputError(f"{target}: cannot be written ({reason}); choose another output folder, where you may write")


def _hidden(target: Path) -> tuple[Path, int]:
    """The first hidden folder of ``target`` that no other writer holds, empty; those of dead writers are removed."""
    folders = (target.with_name(f".{target.name}.{k}.part") for k in itertools.count())
    folder, handle = next((folder, held) for folder in folders if (held := claim(folder)) is not None)
    clear(folder)
    for left in itertools.takewhile(Path.exists, folders):
        other = claim(left)
        if other is not None:
            release(left, other)
    return folder, handle
