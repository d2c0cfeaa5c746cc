"""What went on while the module ran: exceptions in callbacks, VTK errors, dialogs and install requests."""

from __future__ import annotations

import sys
import traceback
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Dialog:
    """A modal dialog that was answered instead of shown."""

    kind: str
    text: str
    answer: Any


@dataclass
class Record:
    """Everything since the last ``clear()``; ``answers`` are given to the next dialogs, in order."""

    errors: list[str] = field(default_factory=list)
    vtk_errors: list[str] = field(default_factory=list)
    dialogs: list[Dialog] = field(default_factory=list)
    pip_requests: list[str] = field(default_factory=list)
    answers: list[Any] = field(default_factory=list)

    def clear(self) -> None:
        for events in vars(self).values():
            events.clear()

    def answer_dialog(self, kind: str, text: str, default: Any) -> Any:
        """Record a dialog and answer it: with the next of ``answers``, else with ``default``."""
        answer = self.answers.pop(0) if self.answers else default
        self.dialogs.append(Dialog(kind, text, answer))
        return answer

    def excepthook(self, kind: type[BaseException], value: BaseException, trace: Any) -> None:
        """For sys.excepthook: Qt slots and VTK observers hand their exceptions there."""
        text = "".join(traceback.format_exception(kind, value, trace))
        self.errors.append(text)
        sys.stderr.write("exception in a callback:\n" + text)


record = Record()
