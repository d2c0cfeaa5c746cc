"""What the user must be told although the run goes on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Notice:
    """A warning: ``code`` is stable and for programs, ``message`` is one plain sentence with units."""

    code: str
    message: str


def plain_number(value: float) -> str:
    """Three significant digits without an exponent: 19200, 1.16, 0.000453."""
    return np.format_float_positional(value, precision=3, fractional=False, trim="-")
