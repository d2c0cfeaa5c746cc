"""How far a worker is, in memory that it shares with its parent and that outlives it."""

from __future__ import annotations

import mmap
import struct
from dataclasses import dataclass
from pathlib import Path

HEAD, SLOT = struct.Struct("<q"), struct.Struct("<4qd")


@dataclass
class Counts:
    """Of one job: the input being tried, what became of those before, processor seconds."""

    index: int
    read: int = 0
    refused: int = 0
    failed: int = 0
    seconds: float = 0.0


class Progress:
    """The job a worker is at, and the counts of each."""

    def __init__(self, path: Path, firsts: list[int], *, new: bool = False) -> None:
        self.jobs = len(firsts)
        if new:
            path.write_bytes(HEAD.pack(0) + b"".join(SLOT.pack(first, 0, 0, 0, 0.0) for first in firsts))
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), HEAD.size + self.jobs * SLOT.size)

    @property
    def job(self) -> int:
        return int(HEAD.unpack(self._memory[: HEAD.size])[0])

    @job.setter
    def job(self, value: int) -> None:
        self._memory[: HEAD.size] = HEAD.pack(value)

    def counts(self, job: int) -> Counts:
        return Counts(*SLOT.unpack_from(self._memory, HEAD.size + job * SLOT.size))

    def note(self, job: int, counts: Counts) -> None:
        values = (counts.index, counts.read, counts.refused, counts.failed, counts.seconds)
        SLOT.pack_into(self._memory, HEAD.size + job * SLOT.size, *values)
