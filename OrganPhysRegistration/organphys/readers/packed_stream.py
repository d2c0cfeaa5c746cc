"""How much a gzip or zlib stream holds, in bounded memory."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from pathlib import Path

CHECKED_BYTES = 100_000_000  # a third of a second
BLOCK = 1 << 20


def inflated_bytes(
    path: Path, start: int, expected: int, *, gzip_form: bool, packed_bytes: int | None = None
) -> int | None:
    """Bytes that the stream from byte ``start`` of a file inflates to, 0 where it is damaged or cut short.

    ``expected``: what the header promises. Up to 100 MB the stream is inflated to its end, which also checks its sum,
    and never far beyond the promise. A larger gzip file ends with its size modulo 2^32, which settles it if it fits; a
    larger zlib stream is left to the library: None.
    """
    if expected > CHECKED_BYTES:
        if not gzip_form:
            return None
        with path.open("rb") as file:
            file.seek(-4, os.SEEK_END)
            beyond = (int.from_bytes(file.read(4), "little") - expected) % 2**32
        if beyond < 4096:
            return expected + beyond
    wbits, total = 31 if gzip_form else 15, 0
    stream = zlib.decompressobj(wbits)
    try:
        for block in _blocks(path, start, packed_bytes):
            while block:
                total += len(stream.decompress(block, BLOCK))
                block = stream.unconsumed_tail
                if stream.eof:
                    block = stream.unused_data
                    if not gzip_form or block[:2] != b"\x1f\x8b":
                        return total
                    stream = zlib.decompressobj(wbits)  # gzip files may follow each other
                if total > expected + CHECKED_BYTES:
                    return total
    except zlib.error:
        return 0
    return total if stream.eof else 0


def _blocks(path: Path, start: int, length: int | None) -> Iterator[bytes]:
    with path.open("rb") as file:
        file.seek(start)
        left = os.path.getsize(path) if length is None else length
        while left > 0 and (block := file.read(min(BLOCK, left))):
            left -= len(block)
            yield block
