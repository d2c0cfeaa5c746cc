"""One child process that writes lines: a thin layer over QProcess, in the way PythonQt offers it."""

from __future__ import annotations

import logging
import os
import signal
import tempfile
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import qt

from .child_program import python_program, server_environment
from .line_buffer import LineBuffer, LineTooLong

KEPT_ERROR_LINES = 50
_dying: set[ChildProcess] = set()  # a QProcess that is destroyed while its program lives waits for it


class ChildProcess:
    """A running program with a private folder that is removed with it.

    ``arguments``: folder -> arguments of the program; ``on_line``: called with every line of its output; ``on_end``:
    called once with a short reason when it ends by itself or its line has no end. After ``kill`` nothing is called.
    """

    def __init__(
        self,
        arguments: Callable[[Path], list[str]],
        *,
        on_line: Callable[[str], None],
        on_end: Callable[[str], None],
    ) -> None:
        self._on_line, self._on_end = on_line, on_end
        self._output, self._error_output = LineBuffer(), LineBuffer()
        self._errors: deque[str] = deque(maxlen=KEPT_ERROR_LINES)
        self._killed = False
        self.pid_of_python = 0  # PythonSlicer is a launcher: the Python it starts has a number of its own
        self._temporary = tempfile.TemporaryDirectory(prefix="organphys_", ignore_cleanup_errors=True)
        self._process = process = qt.QProcess()
        process.setProcessEnvironment(server_environment())
        # PythonQt keeps no reference to a bound method: these do
        self._slots = {
            "readyReadStandardOutput()": self._read_output,
            "readyReadStandardError()": self._read_errors,
            "finished(int,QProcess::ExitStatus)": self._finished,
            "errorOccurred(QProcess::ProcessError)": self._failed,
        }
        for name, slot in self._slots.items():
            process.connect(name, slot)
        process.start(python_program(), arguments(self.folder))

    @property
    def folder(self) -> Path:
        """Private folder, shared with the program."""
        return Path(self._temporary.name)

    @property
    def error_text(self) -> str:
        """The last lines of its standard error."""
        return "\n".join(self._errors)

    def write(self, line: str) -> None:
        """One line to its standard input; returns at once."""
        self._process.write((line + "\n").encode("utf-8"))

    def kill(self) -> None:
        """End the program now; neither ``on_line`` nor ``on_end`` is called any more."""
        if self._killed:
            return
        self._killed = True
        _dying.add(self)
        if self.pid_of_python:
            _kill_process(self.pid_of_python)
        self._process.kill()
        self._temporary.cleanup()

    def _read_output(self) -> None:
        if self._killed:
            return
        try:
            lines = self._output.feed(_bytes(self._process.readAllStandardOutput()))
        except LineTooLong as error:
            self._end(str(error))
            return
        for line in lines:
            if not self._killed:  # by what the line before told
                self._on_line(line)

    def _read_errors(self) -> None:
        try:
            self._errors.extend(self._error_output.feed(_bytes(self._process.readAllStandardError())))
        except LineTooLong as error:
            self._errors.append(str(error))
            self._error_output = LineBuffer()

    def _finished(self, exit_code: int, exit_status: Any) -> None:
        _dying.discard(self)
        self.pid_of_python = 0
        if self._killed:
            self._temporary.cleanup()  # again: Windows keeps files that a living program has open
            return
        self._read_output()
        self._read_errors()
        self._end(self._errors[-1] if self._errors else f"exit code {exit_code}")

    def _failed(self, error: Any) -> None:
        if error == qt.QProcess.FailedToStart and not self._killed:  # every other error is followed by "finished"
            _dying.discard(self)
            self._end(f"{python_program()} cannot be run")

    def _end(self, reason: str) -> None:
        if self._killed:
            return
        self.kill()
        _dying.discard(self)
        logging.error("OrganPhys: the registration process ended: %s\n%s", reason, self.error_text)
        self._on_end(reason)


def _bytes(data: Any) -> bytes:
    """Bytes of a QByteArray."""
    return bytes(data.data())


def _kill_process(pid: int) -> None:
    try:
        os.kill(pid, getattr(signal, "SIGKILL", signal.SIGTERM))
    except OSError as error:  # it has ended already
        logging.debug("OrganPhys: process %d: %s", pid, error)
