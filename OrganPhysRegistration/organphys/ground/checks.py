"""Checks of what comes from outside: they raise InputError, one line that says what to do."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


LARGEST = 1e12  # of a coordinate: beyond, squares of distances lose all digits or overflow
LONGEST_MESSAGE = 1000


class InputError(ValueError):
    """Input, option or file that cannot be used; the message is one line and names the remedy."""

    def __init__(self, message: object = "") -> None:
        super().__init__(one_line(str(message)))


def one_line(text: str, *, longest: int = LONGEST_MESSAGE) -> str:
    """A text from anywhere as one line that a terminal and a report can show; the middle of a long one is left out."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else " " if c.isspace() else "\ufffd" for c in text)
    if len(text) > longest:
        text = f"{text[: longest // 2 - 3]} ... {text[len(text) - longest // 2 + 2 :]}"
    return text


def as_points(points: ArrayLike, name: str = "points", *, minimum: int = 1) -> Array:
    """Finite float64 array of shape (N, 3), N >= minimum; InputError names the argument otherwise."""
    try:
        array = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: expected numbers of shape (N, 3), got {type(points).__name__}") from error
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{name}: expected an array of shape (N, 3), got shape {array.shape}")
    if len(array) < minimum:
        raise InputError(f"{name}: expected at least {minimum} points, got {len(array)}")
    if not np.isfinite(array).all():
        raise InputError(f"{name}: {int((~np.isfinite(array)).any(1).sum())} of {len(array)} points are not finite")
    return array


def as_vector(vector: ArrayLike, name: str = "vector") -> Array:
    """Finite float64 array of shape (3,)."""
    try:
        array = np.asarray(vector, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"{name}: expected three finite numbers, got {str(vector)[:60]}")
    return array


def as_positive(value: float, name: str) -> float:
    """A finite number above zero."""
    number = float(value)
    if not np.isfinite(number) or number <= 0:
        raise InputError(f"{name}: expected a finite number above 0, got {value}")
    return number


def one_of(value: str, name: str, allowed: tuple[str, ...]) -> str:
    """A value out of a fixed list."""
    if value not in allowed:
        raise InputError(f"{name}: expected one of {', '.join(allowed)}, got {value!r}")
    return value
