"""What the user must be told although the run goes on."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Notice:
    """A warning: ``code`` is stable and for programs, ``message`` is one plain sentence with units."""

    code: str
    message: str
