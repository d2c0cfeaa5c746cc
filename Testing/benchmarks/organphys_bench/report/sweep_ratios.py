"""Errors of a sweep by method and level, of the same cases and seeds throughout."""

from __future__ import annotations

import numpy as np

from organphys.ground.checks import Array

from ..peers.methods import METHODS
from ..runs.conditions import Sweep
from .run_set import Run, RunSet

Found = dict[tuple[str, float], dict[tuple[str, int], float]]
"""Ratios by method and level, then by case and seed."""


def paired_ratios(runs: RunSet, sweep: Sweep) -> tuple[tuple[str, ...], dict[str, dict[float, Array]]]:
    """Names of the cases; and by method and level the TRE over the best similarity's of every seed of these that all
    methods have run there, infinite for a run without a result. A case without all levels is left out, so that no curve
    changes its cases on the way."""
    found = _found(runs, sweep)
    methods = [name for name in METHODS if any(name == method for method, _ in found)]
    levels = sorted({level for _, level in found})
    common = {level: set.intersection(*(set(found.get((m, level), ())) for m in methods)) for level in levels}
    common = {level: pairs for level, pairs in common.items() if pairs}
    cases = set.intersection(*({case for case, _ in pairs} for pairs in common.values())) if common else set()
    ratios: dict[str, dict[float, Array]] = {method: {} for method in methods if cases}
    for level, pairs in common.items():
        kept = sorted(pair for pair in pairs if pair[0] in cases)
        for method in ratios:
            ratios[method][level] = np.array([found[method, level][pair] for pair in kept])
    return tuple(sorted(cases)), ratios


def ratio(run: Run) -> float:
    """TRE over that of the best similarity."""
    return float("inf") if run["failure"] else float(run["figures"]["ratio_to_oracle"])


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
