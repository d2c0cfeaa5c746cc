"""The command ``organphys``: options and exit codes. The work is in commands_*.py, imported once it is needed.

Exit codes: 0 done; 2 input or option that cannot be used (one line on stderr); 3 a batch is done but for failed cases;
130 stopped by Ctrl-C.
Numpy and the readers are imported after the options are parsed, so that ``--help`` answers at once.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
import threading
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from .. import __version__
from .command_options import add_demo, add_info, add_map, add_register
from .command_options_batch import add_batch
from .command_options_follow import add_follow
from .command_options_simulate import add_export, add_simulate

_DONE, _ERROR, _STOPPED = 0, 2, 130
_NUMBER = re.compile(r"-(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$")
_COORDINATES = re.compile(r"-[\d.]+([eE][-+]?\d+)?\s*,")


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(_ERROR, f"organphys: error: {message}; see {self.prog} --help\n")


def build_parser() -> argparse.ArgumentParser:
    """The whole command line."""
    parser = _Parser(
        prog="organphys",
        description="Registers an organ from a CT or MR label map onto an endoscopic 3D Gaussian splat.",
        epilog="Exit codes: 0 done, 2 input or option error, 3 a batch with failed cases, 130 stopped by Ctrl-C. CT "
        "points are RAS mm, scene points are the raw coordinates of the splat file.",
    )
    parser.add_argument("--version", action="version", version=f"organphys {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in (add_register, add_batch, add_follow, add_map, add_info, add_simulate, add_export, add_demo):
        add(commands)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit code. Option errors and --help leave by SystemExit, as argparse does."""
    arguments = build_parser().parse_args(_with_negative_values(sys.argv[1:] if argv is None else argv))
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _stop)
    before = _written(arguments)
    try:
        code: int | None = import_module(f".commands_{arguments.command}", __package__).run(arguments)
    except KeyboardInterrupt as stop:  # a command that keeps what is done says so itself
        if stop.args:
            return _fail(f"organphys: {stop}", _STOPPED)
        if _written(arguments) != before:  # results come all at once: it was at its last words
            return _fail("organphys: stopped, but all results are written", _STOPPED)
        return _fail("organphys: stopped, nothing was written", _STOPPED)
    except BrokenPipeError:  # the reader of our output, `head` say, has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _DONE
    except (ValueError, OSError, MemoryError) as error:
        message = message_of(error)
        if message is None:
            raise
        return _fail(f"organphys: error: {message}", _ERROR)
    return code or _DONE


def _stop(number: int, frame: object) -> NoReturn:
    """SIGTERM ends the command as Ctrl-C does: what is half-written is removed."""
    raise KeyboardInterrupt


def _written(arguments: argparse.Namespace) -> object:
    """What lies at --out, to compare: the file, or the entries of the folder that are not hidden."""
    try:
        if os.path.isdir(arguments.out):
            return {(entry.name, entry.inode()) for entry in os.scandir(arguments.out) if entry.name[0] != "."}
        found = os.stat(arguments.out)
    except (AttributeError, TypeError, OSError):  # no --out, or nothing there
        return None
    return found.st_ino, found.st_mtime_ns


def message_of(error: Exception) -> str | None:
    """What to tell the user; None for an error of the program itself, which keeps its traceback."""
    from ..ground.checks import InputError

    if isinstance(error, InputError):
        return " ".join(str(error).split())
    if isinstance(error, MemoryError):
        return "not enough memory: crop the label map or the splat and try again"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror or error}; check the path and its permissions"
    return None


def _fail(line: str, code: int) -> int:
    print(line, file=sys.stderr)
    return code


def _with_negative_values(argv: Sequence[str]) -> list[str]:
    """The arguments with values such as -1e-3 or -10,20,30 in a form that argparse does not take for an option."""
    result: list[str] = []
    for token in argv:
        if _COORDINATES.match(token) and result and result[-1].startswith("--"):
            result[-1] += f"={token}"
        elif _NUMBER.match(token) and "e" in token.lower():
            result.append(f"{float(token):.30f}".rstrip("0").rstrip("."))
        else:
            result.append(token)
    return result
