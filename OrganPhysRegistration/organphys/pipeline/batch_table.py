"""The table of a batch: a header and one line per case, read and checked as a whole."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from ..ground.checks import InputError
from .batch_records import BatchCase
from .batch_row import RowReader

MOST_BYTES, MOST_CASES, MOST_TOLD = 20_000_000, 5_000, 10


def read_batch(path: str | Path) -> list[BatchCase]:
    """All cases of a table, in its order, every small input read and checked: nothing starts before all lines are fine.

    InputError in one line names the first ten errors by their line.
    """
    table = Path(path)
    reader, rows = RowReader(table.absolute().parent), _rows(table)
    columns = _columns(table, rows[0][1], reader)
    found = [_case_or_error(line, cells, columns, reader) for line, cells in rows[1:]]
    cases = [case for case in found if isinstance(case, BatchCase)]
    errors = [error for error in found if isinstance(error, str)] + _doubles(cases)
    if errors:
        more = f"; and {len(errors) - MOST_TOLD} more" if len(errors) > MOST_TOLD else ""
        raise InputError(f"{table}: nothing was run; {'; '.join(errors[:MOST_TOLD])}{more}")
    if not cases:
        raise InputError(f"{table}: no case below the header; give one line per case")
    return cases


def _text(table: Path) -> str:
    if not table.is_file():
        raise InputError(f"{table}: no such file; give a table of cases (CSV)")
    if table.stat().st_size > MOST_BYTES:
        raise InputError(f"{table}: is larger than {MOST_BYTES // 1_000_000} MB; that is no table of cases")
    try:
        return table.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{table}: is not UTF-8 text; save the table as CSV (UTF-8)") from error


def _rows(table: Path) -> list[tuple[int, list[str]]]:
    """Number of its first line and cells of every row that is not empty, the header among them."""
    text = _text(table)
    head = text.split("\n", 1)[0]
    delimiter = next((mark for mark in ",;\t" if mark in head), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    rows, line = [], 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows.append((line, [cell.strip() for cell in cells]))
            if len(rows) > MOST_CASES + 1:
                raise InputError(f"{table}: more than {MOST_CASES} cases; split the table")
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(f"{table}: line {line}: {error}; write the table as CSV again") from error
    if not rows:
        raise InputError(f"{table}: is empty; give a header line and one line per case")
    return rows


def _columns(table: Path, names: list[str], reader: RowReader) -> list[str]:
    """The names of the header's columns; "--mm-per-unit" and "MM_per_unit" are the same."""
    columns = [name.lower().lstrip("-").replace("-", "_") for name in names]
    unknown = [name for name, column in zip(names, columns, strict=True) if column not in reader.columns]
    double = sorted(name for name, times in Counter(columns).items() if times > 1)
    missing = [name for name in reader.needed if name not in columns]
    for wrong, words in ((unknown, "unknown"), (double, "given twice"), (missing, "missing")):
        if wrong:
            listed = ", ".join(repr(name) for name in wrong)
            known = ", ".join(reader.columns)
            raise InputError(f"{table}: line 1: column {listed} {words}; the columns are {known}")
    return columns


def _case_or_error(line: int, cells: list[str], columns: list[str], reader: RowReader) -> BatchCase | str:
    if len(cells) != len(columns):
        words = f"{len(cells)} cells under {len(columns)} columns"
        return f"line {line}: {words}; put quotes about a cell that holds the separator"
    try:
        return reader.case(line, dict(zip(columns, cells, strict=True)))
    except InputError as error:
        return f"line {line}: {error}"


def _doubles(cases: Iterable[BatchCase]) -> list[str]:
    """Errors of names that would share a folder, on file systems too that do not tell a from A."""
    first: dict[str, int] = {}
    errors = []
    for case in cases:
        line = first.setdefault(case.name.casefold(), case.line)
        if line != case.line:
            errors.append(f"line {case.line}: case {case.name!r} is also on line {line}; give each its own name")
    return errors
