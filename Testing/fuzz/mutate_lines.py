"""Mutations of texts made of lines and words: the headers of PLY, NRRD and MetaImage, CSV and fiducial lists."""

from __future__ import annotations

import re

from hostile import INTEGERS, REALS, TEXTS
from mutate_bytes import Rng, pick

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[^\s,:=()]+")


def mutate_lines(content: bytes, rng: Rng) -> bytes:
    """One to three edits of lines, words or numbers."""
    for _ in range(1 + int(rng.random() < 0.4) + int(rng.random() < 0.2)):
        kind = rng.random()
        if kind < 0.4:
            content = _replaced(content, NUMBER, _number(rng), rng)
        elif kind < 0.55:
            content = _replaced(content, WORD, _text(rng), rng)
        elif kind < 0.65:
            content = _replaced(content, WORD, _other_word(content, rng), rng)
        else:
            content = _edited_lines(content, rng)
    return content


def _number(rng: Rng) -> bytes:
    if rng.random() < 0.2:
        return str(int(rng.integers(-10, 300))).encode()
    return str(pick(rng, INTEGERS if rng.random() < 0.6 else REALS)).encode()


def _text(rng: Rng) -> bytes:
    return str(pick(rng, TEXTS)).encode("utf-8", errors="replace")


def _other_word(content: bytes, rng: Rng) -> bytes:
    words = WORD.findall(content)
    return pick(rng, words) if words else b"x"


def _replaced(content: bytes, pattern: re.Pattern[bytes], new: bytes, rng: Rng) -> bytes:
    found = list(pattern.finditer(content))
    if not found:
        return content + new
    match = found[int(rng.integers(len(found)))]
    return content[: match.start()] + new + content[match.end() :]


def _edited_lines(content: bytes, rng: Rng) -> bytes:
    lines = content.split(b"\n")
    at, other = int(rng.integers(len(lines))), int(rng.integers(len(lines)))
    kind = int(rng.integers(7))
    if kind == 0:
        del lines[at]
    elif kind == 1:
        lines.insert(other, lines[at])
    elif kind == 2:
        lines[at], lines[other] = lines[other], lines[at]
    elif kind == 3:
        lines.insert(at, _text(rng) + b" " + _number(rng))
    elif kind == 4:
        return content.replace(b"\n", pick(rng, (b"\r\n", b"\r", b"\n\n")))
    elif kind == 5:
        lines[at] += pick(rng, (b" ", b",", b" 1", b",1", b"\t", b"#", b'"'))
    else:
        lines[at : at + 1] = [lines[at]] * int(rng.integers(2, 30))
    return b"\n".join(lines)
