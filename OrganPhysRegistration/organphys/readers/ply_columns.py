"""Rows of the elements of a PLY file (memory mapped when binary), and columns taken out of them in blocks."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from .ply_header import FORMATS, PlyElement, PlyHeader

BLOCK_ROWS = 1 << 17

Rows = NDArray[Any]


def element_rows(header: PlyHeader) -> dict[str, Rows]:
    """Structured rows of the elements up to the last without lists: faces, which no splat needs, are left unread.

    Binary ones are mapped, not read. InputError where rows are missing or no numbers.
    """
    wanted = [k for k, element in enumerate(header.elements) if not element.lists]
    elements = header.elements[: max(wanted, default=-1) + 1]
    if any(element.lists for element in elements):
        raise InputError(f"{header.path}: an element with lists comes before others; export the splat again")
    return _ascii_rows(header, elements) if header.format == "ascii" else _binary_rows(header, elements)


def _dtype(header: PlyHeader, element: PlyElement) -> np.dtype:
    order = FORMATS[header.format]
    return np.dtype([(name, order + kind) for name, kind in element.properties])


def _binary_rows(header: PlyHeader, elements: tuple[PlyElement, ...]) -> dict[str, Rows]:
    rows: dict[str, Rows] = {}
    at = header.size
    for element in elements:
        dtype = _dtype(header, element)
        if element.count and dtype.itemsize:
            rows[element.name] = np.memmap(header.path, dtype, mode="r", offset=at, shape=(element.count,))
        else:
            rows[element.name] = np.zeros(element.count if dtype.itemsize else 0, dtype)
        at += element.count * dtype.itemsize
    return rows


def _ascii_rows(header: PlyHeader, elements: tuple[PlyElement, ...]) -> dict[str, Rows]:
    with header.path.open("r", encoding="ascii", errors="replace", newline=None) as file:
        file.seek(header.size)
        return {element.name: _element_text(file, header, element) for element in elements}


def _element_text(file: IO[str], header: PlyHeader, element: PlyElement) -> Rows:
    dtype, lines = _dtype(header, element), (line for line in file if not line.isspace())
    rows = np.zeros(element.count if dtype.itemsize else 0, dtype)
    for start in range(0, len(rows), BLOCK_ROWS):
        block = list(islice(lines, min(BLOCK_ROWS, len(rows) - start)))
        try:
            if len(block) < min(BLOCK_ROWS, len(rows) - start):
                raise ValueError("rows are missing")
            rows[start : start + len(block)] = np.loadtxt(block, dtype, comments=None, ndmin=1)
        except (ValueError, OverflowError) as error:
            raise InputError(
                f"{header.path}: the {element.name[:40]!r} rows are damaged or truncated ({str(error)[:160]}); "
                "export the splat again"
            ) from error
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
        with np.errstate(invalid="ignore"):  # signalling NaNs, which are masked
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
