"""One row of a batch's table, its cells taken as the options of ``organphys register``."""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn

from ..ground.checks import InputError, as_vector
from ..readers.landmarks_file import COORDINATES
from .batch_records import BatchCase
from .command_options import add_register
from .commands_register import small_inputs

FILES = ("labels", "splat", "roi", "landmarks", "splat_landmarks")
YES, NO = ("yes", "true", "1"), ("no", "false", "0")
_NAME = re.compile(r"\w([\w .-]{0,98}[\w-])?")
_TAKEN = ("errors", "summary.csv", "summary.html")


class _RowParser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise InputError(message.removeprefix("argument "))


class RowReader:
    """Makes cases of rows; ``folder``: where relative paths begin."""

    def __init__(self, folder: Path) -> None:
        commands = _RowParser().add_subparsers(parser_class=_RowParser)
        add_register(commands)
        self._folder = folder
        self._parser: argparse.ArgumentParser = commands.choices["register"]
        self._options = {a.dest: a for a in self._parser._actions if a.dest not in ("help", "out", "quiet")}

    @property
    def columns(self) -> list[str]:
        """Names of all columns that a table may have."""
        return ["case", *self._options]

    @property
    def needed(self) -> list[str]:
        """Names of those that it must have."""
        return ["case", *(name for name, action in self._options.items() if action.required)]

    def case(self, line: int, row: Mapping[str, str]) -> BatchCase:
        """The case of a row; its small inputs are read and checked. InputError tells what cannot be used."""
        name = row["case"]
        if not _NAME.fullmatch(name) or name.lower() in _TAKEN:
            raise InputError(f"case: expected a name for a folder (letters, digits, '_', '-', '.', ' '), got {name!r}")
        arguments = self._arguments({column: cell for column, cell in row.items() if cell and column != "case"})
        for column in ("labels", "splat"):
            if not os.path.isfile(getattr(arguments, column)):  # a name too long for a file is none too
                raise InputError(f"{column}: {getattr(arguments, column)}: no such file")
        small_inputs(arguments)
        return BatchCase(name, line, arguments)

    def _arguments(self, cells: Mapping[str, str]) -> argparse.Namespace:
        argv = ["--out="]
        for column, cell in cells.items():
            flag = self._options[column].option_strings[0]
            if self._options[column].nargs == 0:
                argv += [flag] if _yes(column, cell) else []
            elif column != "camera":
                argv.append(f"{flag}={self._located(column, cell)}")
        arguments = self._parser.parse_args(argv)
        if "camera" in cells:
            arguments.camera = _three_numbers(cells["camera"])
        return arguments

    def _located(self, column: str, cell: str) -> str:
        """A path from the table's folder; coordinates of landmarks and all else as they are."""
        return cell if column not in FILES or COORDINATES.fullmatch(cell) else str(self._folder / cell)


def _yes(column: str, cell: str) -> bool:
    if cell.lower() not in YES + NO:
        raise InputError(f"{column}: expected yes or no, got {cell!r}")
    return cell.lower() in YES


def _three_numbers(cell: str) -> list[float]:
    try:
        values: list[float] = as_vector([float(part) for part in cell.replace(",", " ").split()]).tolist()
    except ValueError as error:
        raise InputError(f"camera: expected three numbers with spaces between, got {cell!r}") from error
    return values
