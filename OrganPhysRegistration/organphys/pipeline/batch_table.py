"""The table of a batch: one line per case, its columns are the options of ``organphys register``."""

from __future__ import annotations

import argparse
import csv
import io
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from ..ground.checks import InputError, as_vector
from ..readers.landmarks_file import COORDINATES
from .command_options import add_register
from .commands_register import small_inputs

FILES = ("labels", "splat", "roi", "landmarks", "splat_landmarks")
MOST_BYTES, MOST_TOLD = 20_000_000, 10
YES, NO = ("yes", "true", "1"), ("no", "false", "0")
_NAME = re.compile(r"\w([\w .-]{0,98}[\w-])?")
_TAKEN = ("errors", "summary.csv", "summary.html")


@dataclass(frozen=True)
class BatchCase:
    """One line of the table: the case's name, the line's number, and what ``organphys register`` would get."""

    name: str
    line: int
    arguments: argparse.Namespace


class _RowParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(message.removeprefix("argument "))


def read_batch(path: str | Path) -> list[BatchCase]:
    """All cases of a table, in its order, every small input read and checked: nothing starts before all lines are fine.

    InputError in one line names the first ten errors by their line.
    """
    table, parser = Path(path), _parser()
    rows = _rows(table)
    columns = _columns(table, rows[0][1], _options(parser))
    found = [_case_or_error(line, cells, columns, table.absolute().parent, parser) for line, cells in rows[1:]]
    cases = [case for case in found if isinstance(case, BatchCase)]
    errors = [error for error in found if isinstance(error, str)] + _doubles(cases)
    if errors:
        more = f"; and {len(errors) - MOST_TOLD} more" if len(errors) > MOST_TOLD else ""
        raise InputError(f"{table}: nothing was run; {'; '.join(errors[:MOST_TOLD])}{more}")
    if not cases:
        raise InputError(f"{table}: no case below the header; give one line per case")
    return cases


def _parser() -> argparse.ArgumentParser:
    """The parser of ``organphys register``, whose errors are exceptions."""
    commands = _RowParser().add_subparsers(parser_class=_RowParser)
    add_register(commands)
    parser: argparse.ArgumentParser = commands.choices["register"]
    return parser


def _options(parser: argparse.ArgumentParser) -> dict[str, argparse.Action]:
    """The options that may be a column, by its name."""
    return {action.dest: action for action in parser._actions if action.dest not in ("help", "out", "quiet")}


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
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(f"{table}: line {line}: {error}; write the table as CSV again") from error
    if not rows:
        raise InputError(f"{table}: is empty; give a header line and one line per case")
    return rows


def _named(columns: list[str], cells: list[str]) -> dict[str, str]:
    if len(cells) != len(columns):
        raise InputError(
            f"{len(cells)} cells under {len(columns)} columns; put quotes about a cell that holds the separator"
        )
    return dict(zip(columns, cells, strict=True))


def _text(table: Path) -> str:
    if not table.is_file():
        raise InputError(f"{table}: no such file; give a table of cases (CSV)")
    if table.stat().st_size > MOST_BYTES:
        raise InputError(f"{table}: is larger than {MOST_BYTES // 1_000_000} MB; that is no table of cases")
    try:
        return table.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{table}: is not UTF-8 text; save the table as CSV (UTF-8)") from error


def _columns(table: Path, names: list[str], options: Mapping[str, argparse.Action]) -> list[str]:
    columns = [name.lower().lstrip("-").replace("-", "_") for name in names]
    known = ["case", *options]
    needed = ["case", *(name for name, action in options.items() if action.required)]
    unknown = [name for name, column in zip(names, columns, strict=True) if column not in known]
    double = sorted({name for name in columns if columns.count(name) > 1})
    missing = [name for name in needed if name not in columns]
    for wrong, words in ((unknown, "unknown"), (double, "given twice"), (missing, "missing")):
        if wrong:
            listed = ", ".join(repr(name) for name in wrong)
            raise InputError(f"{table}: line 1: column {listed} {words}; the columns are {', '.join(known)}")
    return columns


def _case_or_error(
    line: int, cells: list[str], columns: list[str], folder: Path, parser: argparse.ArgumentParser
) -> BatchCase | str:
    try:
        return _case(line, _named(columns, cells), folder, parser)
    except InputError as error:
        return f"line {line}: {error}"


def _case(line: int, row: Mapping[str, str], folder: Path, parser: argparse.ArgumentParser) -> BatchCase:
    name = row["case"]
    if not _NAME.fullmatch(name) or name.lower() in _TAKEN:
        raise InputError(f"case: expected a name for a folder (letters, digits, '_', '-', '.', ' '), got {name!r}")
    given = {column: cell for column, cell in row.items() if cell and column != "case"}
    camera = given.pop("camera", None)
    options, argv = _options(parser), []
    for column, cell in given.items():
        flag = options[column].option_strings[0]
        if options[column].nargs == 0:
            argv += [flag] if _yes(column, cell) else []
        else:
            argv.append(f"{flag}={_located(column, cell, folder)}")
    arguments = parser.parse_args([*argv, "--out="])
    if camera is not None:
        arguments.camera = _numbers(camera)
    for column in ("labels", "splat"):
        if not Path(getattr(arguments, column)).is_file():
            raise InputError(f"{column}: {getattr(arguments, column)}: no such file")
    small_inputs(arguments)
    return BatchCase(name, line, arguments)


def _located(column: str, cell: str, folder: Path) -> str:
    """A path from the table's folder; coordinates of landmarks and all else as they are."""
    return cell if column not in FILES or COORDINATES.fullmatch(cell) else str(folder / cell)


def _yes(column: str, cell: str) -> bool:
    if cell.lower() not in YES + NO:
        raise InputError(f"{column}: expected yes or no, got {cell!r}")
    return cell.lower() in YES


def _numbers(cell: str) -> list[float]:
    """Three numbers with spaces or commas between."""
    parts: Any = cell.replace(",", " ").split()
    try:
        return [float(value) for value in as_vector([float(part) for part in parts], "camera")]
    except ValueError as error:
        raise InputError(f"camera: expected three numbers with spaces between, got {cell!r}") from error


def _doubles(cases: Iterable[BatchCase]) -> list[str]:
    """Errors of names that would share a folder, on file systems too that do not tell a from A."""
    first: dict[str, int] = {}
    errors = []
    for case in cases:
        line = first.setdefault(case.name.casefold(), case.line)
        if line != case.line:
            errors.append(f"line {case.line}: case {case.name!r} is also on line {line}; give each its own name")
    return errors
