"""The finished runs, found by case and method, and what is computed over them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..peers.methods import METHODS
from ..runs.conditions import BASELINE

Run = dict[str, Any]
SUCCESS = 2.0
"""A registration has succeeded where its mean TRE is at most so many times that of the best similarity."""


@dataclass(frozen=True)
class RunSet:
    """runs: of all conditions."""

    runs: Sequence[Run]

    @cached_property
    def baseline(self) -> dict[tuple[str, str], Run]:
        """By case and method."""
        return {(run["case"], run["method"]): run for run in self.runs if run["condition"]["sweep"] == BASELINE}

    @cached_property
    def cases(self) -> list[str]:
        return sorted({run["case"] for run in self.runs})

    @cached_property
    def methods(self) -> list[str]:
        """Those of the main table that have run, in its order."""
        there = {run["method"] for run in self.runs}
        return [name for name, method in METHODS.items() if name in there and not method.extra]

    def value(self, case: str, method: str, read: Callable[[Run], float]) -> float:
        """``read`` of a baseline run's figures; nan where there is none or it failed."""
        run = self.baseline.get((case, method))
        return float("nan") if run is None or run["failure"] else float(read(run["figures"]))

    def values(self, method: str, read: Callable[[Run], float]) -> np.ndarray:
        """(cases,) of one method."""
        return np.array([self.value(case, method, read) for case in self.cases])

    def oracle_mm(self, case: str) -> float:
        """Mean TRE of the best similarity."""
        found = [self.value(case, method, lambda figures: figures["oracle_mm"]) for method in METHODS]
        known = [value for value in found if np.isfinite(value)]
        return known[0] if known else float("nan")

    def start(self, case: str) -> Run | None:
        """Figures of the start that the peers share, TRE and residuals; None where no peer has run."""
        for method in self.methods:
            run = self.baseline.get((case, method))
            if run and not run["failure"] and "start" in run["figures"]["stages"]:
                return run["figures"]["stages"]["start"]
        return None

    def start_mm(self, case: str) -> float:
        """Mean TRE of that start."""
        start = self.start(case)
        return float("nan") if start is None else start["tre_mm"]["all"]["mean"]

    def failures(self) -> list[str]:
        """One line for every run without a result."""
        return [
            f"{run['case']}, {run['method']}, {run['condition']['sweep']}: {run['failure']}"
            for run in self.runs
            if run["failure"]
        ]


def mean_tre(figures: Run) -> float:
    """Mean TRE in mm over all points."""
    return figures["tre_mm"]["all"]["mean"]


def ratio(figures: Run) -> float:
    """Mean TRE over that of the best similarity."""
    return figures["ratio_to_oracle"]


def number(value: float, digits: int = 2) -> str:
    """A cell: "-" for what is not known."""
    return "-" if not np.isfinite(value) else f"{value:.{digits}f}"
