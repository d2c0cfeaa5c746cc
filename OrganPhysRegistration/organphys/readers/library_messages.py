"""What a C or C++ library prints on stderr while it reads: kept off the terminal, and there to be read.

ITK's MetaImage reader prints the only true account of a damaged file, and raises another one or none at all.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress

MOST_BYTES = 10_000
DAMAGE = ("uncompress failed", "not read completely")


@contextmanager
def library_messages() -> Iterator[list[str]]:
    """Lines printed on file descriptor 2 within the block; the list is filled when the block ends."""
    lines: list[str] = []
    with suppress(OSError, ValueError, AttributeError):
        sys.stderr.flush()
    with tempfile.TemporaryFile() as file:
        try:
            kept = os.dup(2)
        except OSError:  # a program without stderr
            yield lines
            return
        os.dup2(file.fileno(), 2)
        try:
            yield lines
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            file.seek(0)
            text = file.read(MOST_BYTES).decode("utf-8", errors="replace")
            lines += [line.strip() for line in text.splitlines() if line.strip()]


def tells_damage(lines: list[str]) -> bool:
    """Whether a reader that raised nothing still reported that voxels are missing."""
    return any(sign in line.lower() for line in lines for sign in DAMAGE)
