"""Files that are either whole or not there: written beside the target, then renamed onto it."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .checks import InputError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Temporary path in the folder of ``path``; it replaces ``path`` when the block ends without an exception.

    On any exception (Ctrl-C too) the temporary file is removed and ``path`` stays as it was. The folder is made if
    it is missing. InputError where it cannot be made or written.
    """
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{target}: this is a folder; name a file inside it")
    temporary = target.with_name(f".{secrets.token_hex(4)}.part.{target.name}")  # ends like the target: .nii.gz
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch(exist_ok=False)
    except OSError as error:
        raise _unwritable(target, error) from error
    try:
        yield temporary
        _replace(temporary, target)
    except BaseException:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        raise


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Text as UTF-8 with LF line ends, atomically."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Bytes, atomically; InputError where the disk refuses them."""
    with atomic_path(path) as temporary:
        try:
            temporary.write_bytes(content)
        except OSError as error:
            raise _unwritable(Path(path), error) from error


def _replace(temporary: Path, target: Path) -> None:
    try:
        os.replace(temporary, target)
    except OSError as error:
        raise _unwritable(target, error) from error


def _unwritable(target: Path, error: OSError) -> InputError:
    reason = error.strerror or str(error)
    return InputError(f"{target}: cannot be written ({reason}); choose an output folder that you may write to")
