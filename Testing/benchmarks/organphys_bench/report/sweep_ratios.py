"""Errors of a sweep by method and level, of the same cases and seeds throughout."""

from __future__ import annotations

import numpy as np

from organphys.ground.checks import Array

from ..peers.methods import METHODS
from ..runs.conditions import Sweep
from .run_set import Run, RunSet

Found = dict[tuple[str, float], dict[tuple[str, int], float]]
"""Ratios by method and level, then by case and seed."""


def complete_ratios(runs: RunSet, sweep: Sweep) -> tuple[tuple[str, ...], dict[str, dict[float, Array]]]:
    """Names of the cases; and by method and level the TRE over the best similarity's, infinite for a run without a
    result. Methods that lack one of these cases at one of the levels are left out, and so is a seed that a method has
    not run on all of them at every level: no curve changes its cases on the way, nor from one method to another."""
    found = _found(runs, sweep)
    methods = [name for name in METHODS if any(name == method for method, _ in found)]
    cases, levels = max((_block(found, method) for method in methods), key=_runs, default=(set[str](), list[float]()))
    ratios: dict[str, dict[float, Array]] = {}
    for method in methods if cases else ():
        of_level = {level: found.get((method, level), {}) for level in levels}
        if all(cases <= _cases(pairs, 0) for pairs in of_level.values()):
            seeds = _seeds(of_level, cases, skipped=0.0 if sweep.added else None)
            ratios[method] = {level: _values(pairs, cases, seeds) for level, pairs in of_level.items()}
    return tuple(sorted(cases)), ratios


def _block(found: Found, method: str) -> tuple[set[str], list[float]]:
    """Cases and levels of which a method has run every pair with seed 0: of all such blocks the one of most runs."""
    done = {level: _cases(pairs, 0) for (name, level), pairs in found.items() if name == method}
    some = [*done.values(), set.intersection(*done.values())]
    return max(((cases, sorted(level for level in done if cases <= done[level])) for cases in some), key=_runs)


def _runs(block: tuple[set[str], list[float]]) -> int:
    return len(block[0]) * len(block[1])


def ratio(run: Run) -> float:
    """TRE over that of the best similarity."""
    return float("inf") if run["failure"] else float(run["figures"]["ratio_to_oracle"])


def _cases(pairs: dict[tuple[str, int], float], seed: int) -> set[str]:
    return {case for case, its_seed in pairs if its_seed == seed}


def _seeds(of_level: dict[float, dict[tuple[str, int], float]], cases: set[str], skipped: float | None) -> list[int]:
    """Those that have run on all ``cases`` at every level but ``skipped``, which has one seed only."""
    swept = [pairs for level, pairs in of_level.items() if level != skipped]
    every = {seed for pairs in swept for _, seed in pairs}
    return sorted(seed for seed in every if all(cases <= _cases(pairs, seed) for pairs in swept))


def _values(pairs: dict[tuple[str, int], float], cases: set[str], seeds: list[int]) -> Array:
    return np.array([pairs[pair] for pair in sorted(pairs) if pair[0] in cases and pair[1] in seeds])


def _found(runs: RunSet, sweep: Sweep) -> Found:
    found: Found = {}
    for run in runs.runs:
        condition = run["condition"]
        if condition["sweep"] == sweep.name:
            found.setdefault((run["method"], condition["level"]), {})[run["case"], condition["seed"]] = ratio(run)
    swept = {(method, case) for (method, _), pairs in found.items() for case, _ in pairs}
    for (case, method), run in runs.baseline.items() if sweep.added else ():
        if (method, case) in swept:  # level 0: the case as it is
            found.setdefault((method, 0.0), {})[case, 0] = ratio(run)
    return found
