"""A result folder that gets all of its files or none, whatever ends the run: Ctrl-C, a full disk, or kill -9."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..ground.atomic_file import unwritable
from ..ground.checks import InputError
from ..ground.hidden_folder import claim, clear, missing_parents, release, remove_empty
from ..ground.interrupts import interrupts_held

MAKING, WHOLE = "making", "whole"


@contextmanager
def whole_or_nothing(folder: str | Path) -> Iterator[Path]:
    """A hidden folder to write into; its files come to ``folder`` when the block ends well.

    A folder that is not there yet appears in one step. In one that is there, older files of the same names go first,
    so that results of two runs never lie side by side; a run that dies at this is finished by the next into the same
    folder. InputError at once where ``folder`` cannot be made or another run is writing into it. After an exception,
    Ctrl-C too, ``folder`` is as it was.
    """
    if not str(folder).strip():
        raise InputError("output folder: no name given; name a folder for the results")
    target = Path(folder)
    made = missing_parents(target)
    held: list[tuple[Path, int]] = []
    try:
        stage = _begin(target, held)
        yield stage
        with interrupts_held():
            _publish(stage, target)
    finally:
        with interrupts_held():
            for hidden, handle in held:
                _leave(hidden, handle)
            remove_empty(made)


def _begin(target: Path, held: list[tuple[Path, int]]) -> Path:
    """An empty folder to write into; what dead runs have left is finished or removed. ``held`` gets what is locked."""
    inside, beside = target / ".organphys", Path(os.path.abspath(target))
    beside = beside.with_name(f".organphys-{beside.name}")
    home = inside if target.is_dir() else beside
    try:
        if target.exists() and not target.is_dir():
            raise FileExistsError(errno.EEXIST, "a file of that name is there")
        home.parent.mkdir(parents=True, exist_ok=True)
        for hidden in (inside, beside):
            if hidden == home or hidden.exists():
                held.append((hidden, _claimed(hidden, target)))
                _finish(hidden, target)
        stage = home / MAKING
        stage.mkdir()
    except OSError as error:
        raise unwritable(target, error) from error
    return stage


def _claimed(hidden: Path, target: Path) -> int:
    handle = claim(hidden)
    if handle is None:
        raise InputError(f"{target}: another run is writing into it; wait for its end (if none runs, delete {hidden})")
    return handle


def _finish(hidden: Path, target: Path) -> None:
    """Results of a dead run that were complete come to their place, all else goes."""
    if (hidden / WHOLE).is_dir():
        _move_files(hidden / WHOLE, target)
    clear(hidden)


def _publish(stage: Path, target: Path) -> None:
    try:
        if not target.exists():
            os.rename(stage, target)
            return
        for path in stage.rglob("*"):
            if path.is_file() and (target / path.relative_to(stage)).is_dir():
                raise IsADirectoryError(errno.EISDIR, f"it holds a folder {path.name}")
        whole = stage.with_name(WHOLE)
        os.rename(stage, whole)  # from here on another run finishes what this one may not
    except OSError as error:
        raise unwritable(target, error) from error
    try:
        _move_files(whole, target)
    except OSError as error:
        words = f"{target}: the results cannot be moved there ({error.strerror or error})"
        raise InputError(f"{words}; they are whole in {whole}, and the next run into the folder moves them") from error


def _move_files(whole: Path, target: Path) -> None:
    """Every file of ``whole`` to the same place below ``target``, once all older ones of these names are gone."""
    places = {path: target / path.relative_to(whole) for path in sorted(whole.rglob("*")) if path.is_file()}
    for place in places.values():
        place.unlink(missing_ok=True)
    for path, place in places.items():
        place.parent.mkdir(parents=True, exist_ok=True)
        os.replace(path, place)
    shutil.rmtree(whole)


def _leave(hidden: Path, handle: int) -> None:
    """Remove the hidden folder; complete results that could not be moved stay in it for the next run."""
    if (hidden / WHOLE).is_dir():
        os.close(handle)
    else:
        release(hidden, handle)
