"""A result folder that gets all of its files or none: written to a hidden folder inside it, moved at the end."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ..ground.checks import InputError


@contextmanager
def whole_or_nothing(folder: str | Path) -> Iterator[Path]:
    """A temporary folder inside ``folder`` to write into; its files move to ``folder`` when the block ends well.

    InputError at once where ``folder`` cannot be made or written. After an exception, Ctrl-C too, ``folder`` is as
    it was: what it held before stays, and it is removed again if it was made here.
    """
    if not str(folder).strip():
        raise InputError("output folder: no name given; name a folder for the results")
    target = Path(folder)
    made = [parent for parent in (target, *target.parents) if not parent.exists()]
    try:
        target.mkdir(parents=True, exist_ok=True)
        stage = Path(tempfile.mkdtemp(prefix=".organphys-", dir=target))
    except OSError as error:
        _remove_empty(made)
        reason = error.strerror or str(error)
        raise InputError(f"{target}: cannot be written ({reason}); choose another output folder") from error
    try:
        yield stage
        _move_files(stage, target)
    finally:
        with _interrupts_held():
            shutil.rmtree(stage, ignore_errors=True)
            _remove_empty(made)


def _move_files(stage: Path, target: Path) -> None:
    """Every file of ``stage`` to the same place below ``target``; Ctrl-C waits until all have moved."""
    with _interrupts_held():
        for source in sorted(stage.rglob("*")):
            if source.is_file():
                place = target / source.relative_to(stage)
                place.parent.mkdir(parents=True, exist_ok=True)
                os.replace(source, place)


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Ctrl-C and SIGTERM are ignored for the length of the block; only the main thread may ask for that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:  # innermost first; a folder that holds something stays
        with suppress(OSError):
            folder.rmdir()
