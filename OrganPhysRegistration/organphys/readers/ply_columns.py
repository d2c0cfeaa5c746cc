"""Rows of a PLY element through plyfile (memory mapped when binary), and columns taken out of them in blocks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from plyfile import PlyData, PlyParseError

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from .ply_header import PlyHeader

BLOCK_ROWS = 1 << 17

Rows = NDArray[Any]


def element_rows(header: PlyHeader) -> dict[str, Rows]:
    """Structured rows of every element; binary files are mapped, not read."""
    try:
        data = PlyData.read(str(header.path), mmap=False if header.format == "ascii" else "r")
        rows = {element.name: element.data for element in data.elements}
    except (PlyParseError, ValueError, OSError, EOFError, OverflowError) as error:
        reason = str(error).splitlines()[0][:160] if str(error) else type(error).__name__
        raise InputError(f"{header.path}: the PLY data is damaged or truncated ({reason}); export it again") from error
    for element in header.elements:
        if len(rows[element.name]) != element.count:
            raise InputError(f"{header.path}: truncated, fewer {element.name!r} rows than declared; export it again")
    return rows


def blocks(count: int, *, progress: Progress = no_progress) -> Iterator[slice]:
    """Slices that cover range(count) in bounded steps."""
    for start in range(0, count, BLOCK_ROWS):
        progress("read", start / count)
        yield slice(start, min(start + BLOCK_ROWS, count))
    progress("read", 1.0)


def stack_columns(rows: Rows, names: tuple[str, ...]) -> NDArray[np.floating]:
    """Columns side by side (N, len(names)), native byte order, float64 where one of them is, else float32."""
    wide = any(rows.dtype[name].kind in "iuf" and rows.dtype[name].itemsize > 4 for name in names)
    out = np.empty((len(rows), len(names)), dtype=np.float64 if wide else np.float32)
    for part in blocks(len(rows)):
        block = rows[part]
        for k, name in enumerate(names):
            out[part, k] = block[name]
    return out


def finite_rows(rows: Rows, *, progress: Progress = no_progress) -> NDArray[np.bool_]:
    """(N,) bool: whether every floating-point number of a row is finite."""
    names = tuple(name for name in rows.dtype.names or () if rows.dtype[name].kind == "f")
    finite = np.ones(len(rows), dtype=bool)
    uniform = len(names) == len(rows.dtype.names or ()) and len({rows.dtype[name] for name in names}) == 1
    for part in blocks(len(rows), progress=progress):
        block = rows[part]
        if uniform:  # one pass over contiguous memory
            table = np.frombuffer(block, dtype=rows.dtype[names[0]]).reshape(len(block), len(names))
            finite[part] = np.isfinite(table).all(axis=1)
        else:
            for name in names:
                finite[part] &= np.isfinite(block[name])
    return finite
