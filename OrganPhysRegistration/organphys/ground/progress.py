"""Progress and cancelling: long functions call ``progress(stage, fraction)``.

To cancel a run the callback raises Cancelled; nothing in the core catches it.
"""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]


class Cancelled(Exception):
    """Raised by a progress callback to stop a run; no output has been written then."""


def no_progress(stage: str, fraction: float) -> None:
    """Progress callback that does nothing."""
