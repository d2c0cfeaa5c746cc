"""Points to map: a .npy array (N, 3), or a .csv with x,y,z."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np

from ..ground.checks import LARGEST, Array, InputError, as_points
from ..ground.npy_header import npy_header
from ..readers.plain_numbers import is_number, number_of

MAX_HEADER_BYTES = 10_000


def read_points(path: str | Path) -> Array:
    """Points (N, 3) float64; InputError for another shape, for text that is not numbers, for pickled arrays."""
    file = Path(path)
    if file.is_dir():
        raise InputError(f"{file}: this is a folder; name a .npy or .csv file in it")
    if not file.is_file():
        raise InputError(f"{file}: no such file; give points as .npy or .csv")
    if file.suffix.lower() == ".npy":
        return _checked(_read_npy(file), file)
    if file.suffix.lower() == ".csv":
        return _checked(_read_csv(file), file)
    raise InputError(f"{file}: unknown kind of point file; give .npy (N, 3) or .csv with x,y,z")


def _checked(values: Any, path: Path) -> Array:
    with np.errstate(invalid="ignore"):  # a signalling NaN is told as any other
        points = as_points(values, str(path))
    if np.abs(points).max() > LARGEST:
        raise InputError(f"{path}: coordinates above {LARGEST:g}; give RAS mm, or scene units with --inverse")
    return points


def _read_npy(path: Path) -> np.ndarray:
    try:
        with path.open("rb") as file:
            header = npy_header(file.read(MAX_HEADER_BYTES))
        if header.dtype.kind not in "iuf":
            raise InputError(f"{path}: holds {header.dtype}, not real numbers; save x,y,z as floating point numbers")
        if len(header.shape) != 2 or header.shape[1] != 3 or header.size > path.stat().st_size - header.offset:
            raise InputError(f"{path}: expected a whole array of shape (N, 3), got shape {header.shape}; save it again")
        numbers = np.fromfile(path, header.dtype, 3 * header.shape[0], offset=header.offset)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a plain .npy array of numbers; write it with numpy.save") from error
    return numbers.reshape(header.shape, order="F" if header.fortran else "C")


def _read_csv(path: Path) -> list[list[float]]:
    """Rows of numbers; a first row of words names the columns, and x, y, z are found among them."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a text file of numbers; give x,y,z separated by commas") from error
    if not rows:
        raise InputError(f"{path}: no points in the file; give one x,y,z per line")
    columns, first = [0, 1, 2], 0
    if not is_number(rows[0][0]):
        names, first = [cell.strip().lower() for cell in rows[0]], 1
        if not {"x", "y", "z"} <= set(names):
            got = ", ".join(names)[:80]
            raise InputError(f"{path}: the header names no x, y and z, got {got}; give x,y,z separated by commas")
        columns = [names.index(axis) for axis in "xyz"]
    elif len(rows[0]) != 3:
        raise InputError(f"{path}: expected three columns x,y,z, got {len(rows[0])}")
    if len(rows) == first:
        raise InputError(f"{path}: no points below the header; give one x,y,z per line")
    return [_numbers(row, columns, path, number) for number, row in enumerate(rows[first:], first + 1)]


def _numbers(row: list[str], columns: list[int], path: Path, number: int) -> list[float]:
    try:
        return [number_of(row[column]) for column in columns]
    except (ValueError, IndexError) as error:
        raise InputError(f"{path}: row {number} is not three numbers x,y,z") from error
