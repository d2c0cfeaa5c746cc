"""Numbers out of JSON values and of text cells: nothing that merely can be turned into one."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..ground.checks import LARGEST, Array, InputError


def plain_numbers(value: Any, count: int, name: str) -> Array:
    """(count,) of a list of as many finite numbers; InputError for texts, truth values, null and beyond 1e12."""
    if not isinstance(value, list) or len(value) != count or not all(type(part) in (int, float) for part in value):
        raise InputError(f"{name}: expected {count} finite numbers, got {str(value)[:60]}")
    if not all(-LARGEST <= part <= LARGEST for part in value):
        raise InputError(f"{name}: expected {count} numbers within +-{LARGEST:g}, got {str(value)[:60]}")
    return np.array(value, dtype=np.float64)


def plain_number(value: Any, name: str) -> float:
    """One of them."""
    return float(plain_numbers([value], 1, name)[0])


def number_of(text: str | None) -> float:
    """The number a text cell shows, NaN for an empty one; ValueError for words, underscores and foreign digits."""
    text = (text or "").strip()
    if "_" in text or not text.isascii():
        raise ValueError(f"{text[:40]!r} is no number")
    return float(text) if text else float("nan")


def is_number(text: str) -> bool:
    """Whether Python reads ``text`` as a number, infinite ones too: what tells a header from a row."""
    try:
        float(text)
    except ValueError:
        return False
    return True
