"""PySide6 6.12 counts on Python 3.12, where None is immortal.

Before 3.12 every Qt call that returns None takes one reference to it away, and after some ten thousand calls the
interpreter ends with "none_dealloc: deallocating None".
"""

from __future__ import annotations

import ctypes
import sys

REFERENCES = 1 << 40  # more than any run can take away


def keep_none() -> None:
    """Give None so many references that it cannot run out of them; nothing is done where None is immortal."""
    if sys.version_info < (3, 12):
        ctypes.c_ssize_t.from_address(id(None)).value += REFERENCES  # CPython: the count comes first in an object
