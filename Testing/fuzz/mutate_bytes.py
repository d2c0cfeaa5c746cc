"""Mutations of bytes of any kind, and of the numbers in them."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

Rng = np.random.Generator
T = TypeVar("T")
WORDS = [struct.pack(f, v) for f in ("<i", ">i") for v in (-1, 0, 1, 2**31 - 1, -(2**31), 2**16, 10**9)]
WORDS += [struct.pack(f, v) for f in ("<q", ">q") for v in (-1, 2**62, 2**40)]
WORDS += [struct.pack(f, v) for f in ("<f", ">f") for v in (np.nan, np.inf, -np.inf, 3e38, 1e-44)]
WORDS += [struct.pack(f, v) for f in ("<d", ">d") for v in (np.nan, np.inf, -np.inf, 1e308, 1e-320)]
WORDS += [struct.pack(f, v) for f in ("<h", ">h") for v in (-1, 0, 1, 32767, -32768)]


def pick(rng: Rng, options: Sequence[T]) -> T:
    """One of a sequence."""
    return options[int(rng.integers(len(options)))]


def _place(rng: Rng, content: bytes) -> int:
    """An index into the content; half of them near its beginning, where headers are."""
    if not content:
        return 0
    end = len(content) if rng.random() < 0.5 else min(len(content), 400)
    return int(rng.integers(end))


def flip_bits(content: bytes, rng: Rng) -> bytes:
    out = bytearray(content)
    for _ in range(int(rng.integers(1, 9)) if out else 0):
        out[_place(rng, content)] ^= 1 << int(rng.integers(8))
    return bytes(out)


def overwrite(content: bytes, rng: Rng) -> bytes:
    at = _place(rng, content)
    kind = rng.random()
    length = int(rng.integers(1, 64))
    new = bytes(length) if kind < 0.3 else b"\xff" * length if kind < 0.5 else rng.bytes(length)
    return content[:at] + new + content[at + length :]


def hostile_word(content: bytes, rng: Rng) -> bytes:
    at, word = _place(rng, content), pick(rng, WORDS)
    if rng.random() < 0.7:
        at -= at % 4
    return content[:at] + word + content[at + len(word) :]


def truncate(content: bytes, rng: Rng) -> bytes:
    if rng.random() < 0.3:
        return content[: max(0, len(content) - int(rng.integers(1, 9)))]
    return content[: _place(rng, content)]


def delete_chunk(content: bytes, rng: Rng) -> bytes:
    at = _place(rng, content)
    return content[:at] + content[at + int(rng.integers(1, 200)) :]


def double_chunk(content: bytes, rng: Rng) -> bytes:
    at, length = _place(rng, content), int(rng.integers(1, 200))
    return content[: at + length] + content[at : at + length] * int(rng.integers(1, 4)) + content[at + length :]


def insert(content: bytes, rng: Rng) -> bytes:
    at = _place(rng, content)
    return content[:at] + rng.bytes(int(rng.integers(1, 40))) + content[at:]


def append(content: bytes, rng: Rng) -> bytes:
    return content + rng.bytes(int(rng.integers(1, 400)))


def move_chunk(content: bytes, rng: Rng) -> bytes:
    a, b, length = _place(rng, content), _place(rng, content), int(rng.integers(1, 100))
    return content[:a] + content[b : b + length] + content[a + length :]


MUTATIONS: tuple[Callable[[bytes, Rng], bytes], ...] = (
    *(flip_bits, flip_bits, overwrite, hostile_word, hostile_word, truncate, delete_chunk, double_chunk, insert),
    *(append, move_chunk),
)


def mutate_bytes(content: bytes, rng: Rng) -> bytes:
    """One to three mutations."""
    for _ in range(1 + int(rng.random() < 0.3) + int(rng.random() < 0.1)):
        content = pick(rng, MUTATIONS)(content, rng)
    return content
