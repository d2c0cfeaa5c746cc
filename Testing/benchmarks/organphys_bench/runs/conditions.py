"""How a case is changed before it is registered: as it is, or one of the sweeps of the full benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from organphys.ground.checks import InputError

if TYPE_CHECKING:
    from case_inputs import CaseInputs

BASELINE = "baseline"


@dataclass(frozen=True)
class Sweep:
    """One quantity made worse (or, for what is seen, better) step by step; ``seeds``: repetitions; ``added``: to the
    case as it is, which is then level 0; note: what else is to be known."""

    name: str
    label: str
    levels: tuple[float, ...]
    seeds: int
    added: bool = False
    note: str = ""


SWEEPS = {
    sweep.name: sweep
    for sweep in (
        Sweep("landmarks", "landmarks moved by, mm", (0, 3, 6, 10), 10),
        Sweep(
            "noise", "noise added to the splat, standard deviation of each of two kinds, mm", (0.3, 0.6, 1.2), 3,
            added=True, note="White noise along the rays and waves of 14 mm length.",
        ),
        Sweep("outliers", "opaque outliers added, % of the splat", (5, 10, 20, 40), 3, added=True),
        Sweep(
            "visibility", "organ surface in a splat made anew, %", (15, 20, 30, 45, 60), 3,
            note="The splat is drawn on the true surface, on the side that the case shows: noise, no outliers.",
        ),
        Sweep(
            "cut", "organ surface left in the case's own splat, %", (10, 15, 20, 25, 30), 3,
            note="Cut along a plane through the camera; a case that shows less is left as it is.",
        ),
    )
}  # fmt: skip


@dataclass(frozen=True)
class Condition:
    """``seed``: of the change and of the method."""

    sweep: str = BASELINE
    level: float = 0.0
    seed: int = 0

    @property
    def text(self) -> str:
        """As on the command line and in file names."""
        return self.sweep if self.sweep == BASELINE else f"{self.sweep}-{self.level:g}-{self.seed}"

    @classmethod
    def parse(cls, text: str) -> Condition:
        """From ``text``; InputError where it names no condition."""
        sweep, *numbers = text.split("-")
        if sweep == BASELINE and not numbers:
            return cls()
        if sweep not in SWEEPS or len(numbers) != 2:
            raise InputError(f"condition: expected {BASELINE} or SWEEP-LEVEL-SEED, got {text}")
        return cls(sweep, float(numbers[0]), int(numbers[1]))

    def changed(self, case: CaseInputs) -> CaseInputs:
        """The case under this condition."""
        from stress import landmarks_off, noise, outliers

        from .visibility import cut_share, seen_share

        rng = np.random.default_rng([self.seed, 77])
        if self.sweep == "landmarks":
            return landmarks_off(case, rng, distance_mm=self.level) if self.level else case
        if self.sweep == "noise":
            return noise(case, rng, sd_mm=self.level)
        if self.sweep == "outliers":
            return outliers(case, rng, share=self.level / 100)
        if self.sweep == "cut":
            return cut_share(case, rng, percent=self.level)
        if self.sweep == "visibility":
            return seen_share(case, rng, percent=self.level)
        return case


def full_conditions(sweeps: Sequence[str] = tuple(SWEEPS)) -> list[Condition]:
    """Every condition of the named sweeps; one seed of everything first."""
    all_of_them = [
        Condition(name, level, seed)
        for name in sweeps
        for level in SWEEPS[name].levels
        for seed in range(SWEEPS[name].seeds)
    ]
    return sorted(all_of_them, key=lambda condition: condition.seed)
