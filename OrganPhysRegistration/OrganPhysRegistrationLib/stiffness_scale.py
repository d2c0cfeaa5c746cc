"""The stiffness slider: 0 % the softest, 100 % the stiffest, even steps of the logarithm of the core's alpha."""

from __future__ import annotations

import math
from typing import Any

from organphys.ground.stiffness import ALPHA_RANGE, PRESET_ALPHA

SOFTEST, STIFFEST = ALPHA_RANGE


def alpha_of(percent: float) -> float:
    """The core's alpha, no unit, for a place of the slider."""
    return SOFTEST * (STIFFEST / SOFTEST) ** (min(max(percent, 0.0), 100.0) / 100)


def percent_of(preset: str) -> float:
    """Place of a preset on the slider, rounded to 1 %."""
    return float(round(100 * math.log(PRESET_ALPHA[preset] / SOFTEST) / math.log(STIFFEST / SOFTEST)))


def stiffness_of(choice: str, percent: Any) -> str | float:
    """What the core is told: the preset's name, or the slider's number for "custom"."""
    if choice != "custom":
        return choice
    return float(f"{alpha_of(float(percent)):.6g}")
