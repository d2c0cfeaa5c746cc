"""The header of a .npy array, read by its form: numpy's own reader evaluates it as Python source."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

MAGIC = b"\x93NUMPY\x01\x00"
HEADER = re.compile(
    rb"\{'descr': '([<>|=][a-zA-Z]\d{0,4})', 'fortran_order': (True|False), "
    rb"'shape': \((|\d{1,18},|\d{1,18}(?:, \d{1,18}){1,7})\), \} *\n"
)


class NpyHeader(NamedTuple):
    """Shape, number type, memory order, and where the numbers begin."""

    shape: tuple[int, ...]
    dtype: np.dtype
    fortran: bool
    offset: int

    @property
    def size(self) -> int:
        """Bytes of all numbers."""
        count = self.dtype.itemsize
        for length in self.shape:
            count *= length
        return count


def npy_header(start: bytes) -> NpyHeader:
    """The header of version 1.0 at the start of a .npy; ValueError for any other than numpy writes of plain numbers.

    Format: numpy/lib/format.py, "Format Version 1.0".
    """
    length = int.from_bytes(start[8:10], "little")
    match = HEADER.fullmatch(start[10 : 10 + length])
    if not start.startswith(MAGIC) or match is None:
        raise ValueError("no plain array of numbers")
    try:
        dtype = np.dtype(match[1].decode())
    except TypeError as error:
        raise ValueError(f"array type {match[1].decode()}") from error
    if dtype.hasobject:
        raise ValueError("pickled objects")
    shape = tuple(map(int, re.findall(rb"\d+", match[3])))
    return NpyHeader(shape, dtype, match[2] == b"True", 10 + length)
