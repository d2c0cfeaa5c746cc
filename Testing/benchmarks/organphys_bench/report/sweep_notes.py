"""What a sweep's table says in words: OrganPhys's failures, and where it is not ahead, with the reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from organphys.ground.checks import Array

from ..peers.methods import METHODS, OURS
from .run_set import SUCCESS, Run
from .sweep_ratios import ratio


def told(swept: Sequence[Run]) -> str:
    """How many of OrganPhys's failures its verdict trusts."""
    ours = [run for run in swept if run["method"] in OURS]
    failed = [run for run in ours if ratio(run) > SUCCESS]
    trusted = sum(run.get("facts", {}).get("verdict") == "trust" for run in failed)
    return f"OrganPhys fails in {len(failed)} of {len(ours)} runs, and says 'trust' in {trusted} of these."


def not_ahead(ratios: dict[str, dict[float, Array]], swept: Sequence[Run]) -> str:
    """The levels at which a peer's median is at most OrganPhys's, and how often the start was wrong there already."""
    lines = []
    for level, ours in ratios.get(OURS[0], {}).items():
        median = {method: float(np.median(by_level[level])) for method, by_level in ratios.items()}
        ahead = {m: value for m, value in median.items() if m not in OURS and value <= np.median(ours)}
        if ahead:
            names = ", ".join(f"{METHODS[method].title} ({value:.2f})" for method, value in ahead.items())
            lines.append(f"at {level:g} not of {names}, itself {np.median(ours):.2f}; {_wrong_starts(swept, level)}")
    return f"OrganPhys is ahead but for: {'. '.join(lines)}." if lines else "OrganPhys is ahead at every level."


def _wrong_starts(swept: Sequence[Run], level: float) -> str:
    """In how many runs the search's pose, of which the peers begin too, is no success."""
    ours = [run for run in swept if (run["method"], run["condition"]["level"]) == (OURS[0], level)]
    starts = [run["figures"] for run in ours if not run["failure"]]
    wrong = sum(f["stages"]["coarse"]["tre_mm"]["all"]["mean"] > SUCCESS * f["oracle_mm"] for f in starts)
    return f"the common start is off by more than {SUCCESS:g} in {wrong} of {len(starts)} runs there"
