"""Why a solver stopped, with advice (after the result records of diffrax)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Stop(Enum):
    """Reason and advice."""

    CONVERGED = "converged"
    SEARCHED = "every candidate was tried"
    BY_HAND = "taken as it was set by hand"
    STEP_LIMIT = "step limit reached before the tolerance: raise the number of steps or accept the residual"
    STALLED = "no step reduced the energy: the result is as good as the numbers allow"
    NO_DATA = "too few correspondences: check landmarks, crop box and opacity threshold"


@dataclass(frozen=True)
class SolveReport:
    """Outcome of one iterative solve."""

    stop: Stop
    iterations: int
    evaluations: int = 0
    residual: float = float("nan")

    @property
    def converged(self) -> bool:
        return self.stop is Stop.CONVERGED
