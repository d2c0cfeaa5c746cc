"""A row of exclusive buttons for an enumerated parameter."""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping
from typing import Any


class ChoiceButtons:
    """``buttons``: value -> checkable, auto-exclusive QPushButton; ``chosen(value)`` is called when the user picks."""

    def __init__(self, buttons: Mapping[enum.Enum, Any], chosen: Callable[[enum.Enum], None]) -> None:
        self._buttons = dict(buttons)
        for value, button in self._buttons.items():
            button.connect("clicked()", lambda value=value: chosen(value))

    def show(self, value: enum.Enum, possible: Mapping[enum.Enum, bool]) -> None:
        """Check the button of ``value`` and enable those that are possible."""
        for choice, button in self._buttons.items():
            button.enabled = possible[choice]
            button.checked = choice is value and possible[choice]
