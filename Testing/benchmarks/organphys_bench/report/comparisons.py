"""Where OrganPhys is not ahead, and how long its elastic stage takes beside finite elements."""

from __future__ import annotations

import numpy as np

from ..peers.methods import METHODS, OURS
from .run_set import RunSet, mean_tre, number
from .table import Table

REGIONS = ("visible", "hidden", "interior")


def not_ahead(runs: RunSet) -> list[str]:
    """One line for every case and peer whose mean TRE is at most OrganPhys's with landmarks, and where it gains."""
    lines = []
    for case in runs.cases:
        ours = runs.value(case, OURS[0], mean_tre)
        for method in runs.methods:
            theirs = runs.value(case, method, mean_tre)
            if method in OURS or not theirs <= ours:
                continue
            where = _where(runs, case, method)
            lines.append(f"{case}: {METHODS[method].title} has {theirs:.2f} mm, OrganPhys {ours:.2f} mm ({where})")
    return lines


def _where(runs: RunSet, case: str, method: str) -> str:
    """Theirs against ours by region, and the scale errors."""
    parts = []
    for region in REGIONS:
        pair = [runs.value(case, name, lambda f, r=region: f["tre_mm"][r]["mean"]) for name in (method, OURS[0])]
        parts.append(f"{region} {pair[0]:.2f} against {pair[1]:.2f}")
    scales = [runs.value(case, name, lambda f: f["scale_error_percent"]) for name in (method, OURS[0])]
    return ", ".join([*parts, f"scale error {scales[0]:+.1f} % against {scales[1]:+.1f} %"])


def verdict_lines(runs: RunSet) -> list[str]:
    """OrganPhys against every peer, in the mean over the cases that both have done."""
    if OURS[0] not in runs.methods:
        return []
    ours = runs.values(OURS[0], mean_tre)
    lines = []
    for method in (name for name in runs.methods if name not in OURS):
        theirs = runs.values(method, mean_tre)
        both = np.isfinite(ours) & np.isfinite(theirs)
        if both.any():
            mine, other = ours[both].mean(), theirs[both].mean()
            word = "ahead of" if mine < other else "NOT ahead of"
            cases = "the cases" if both.all() else f"{both.sum()} of {len(both)} cases"
            lines.append(f"{word} {METHODS[method].title}: mean over {cases} {mine:.2f} against {other:.2f} mm")
    return lines


def solver_table(runs: RunSet) -> Table | None:
    """Reduced basis against finite elements: same start, levels, data terms, energy and stopping tolerance."""
    rows = [row for method in ("fem_icp", "fem_icp_fine") for row in _solver_rows(runs, method)]
    if not rows:
        return None
    columns = ("case", "nodes / tetrahedra", "outer steps, FEM", "Newton steps", "processor s, FEM", "TRE mm, FEM")
    return Table(
        "Elastic stage: reduced basis against finite elements",
        (*columns, "outer steps, reduced", "processor s, reduced", "s of matching", "FEM / reduced", "solving alone"),
        tuple(rows),
        "Same start, levels, data terms, energy and stopping rule (largest move below 5e-4 of the organ's rms radius, "
        "inner steps below a predicted decrease of 1e-10 or six of them), one after the other in one process. Meshing "
        "and assembly are not counted. Finding visible points and matches costs both the same in every outer step and "
        "bounds the ratio (aim: 20); 'solving alone' leaves it out of both. The ratio goes with the mesh as well: "
        "first the peer of the main table, then the same on a finer mesh where that has run.",
    )


def _solver_rows(runs: RunSet, method: str) -> list[tuple[str, ...]]:
    """A row per case and one for the mean ratios."""
    rows, ratios = [], []
    for case in runs.cases:
        run = runs.baseline.get((case, method))
        if run is None or run["failure"]:
            continue
        facts, seconds = run["facts"], run["seconds"]["elastic"]["processor_s"]
        reduced, matching, alone = _without_matching(facts, seconds)
        ratios.append((facts["time_ratio_to_reduced"], alone))
        rows.append(
            (case, f"{facts['nodes']} / {facts['tetrahedra']}", str(facts["outer_steps"]), str(facts["newton_steps"]),
             number(seconds, 1), number(mean_tre(run["figures"])), str(facts["reduced_outer_steps"]),
             number(reduced, 1), number(matching, 1), *(number(ratio, 1) for ratio in ratios[-1]))
        )  # fmt: skip
    if rows:
        rows.append((f"mean of {len(ratios)}", *[""] * 8, *(number(mean, 1) for mean in np.mean(ratios, axis=0))))
    return rows


def _without_matching(facts: dict, seconds: float) -> tuple[float, float, float]:
    """Processor seconds of the reduced solver, of its matching (as many steps at what the FEM's took each), and the
    ratio of what is left of both; not known of older runs."""
    reduced, spent = facts["reduced_processor_s"], facts.get("matching_processor_s", np.nan)
    matching = spent / facts["outer_steps"] * facts["reduced_outer_steps"]
    return reduced, matching, (seconds - spent) / (reduced - matching)
