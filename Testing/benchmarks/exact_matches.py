"""The most that can be had from what is seen: the elastic stage with exact matches of the visible truth points.

    python Testing/benchmarks/exact_matches.py DIR [--seeds 3] [--out RESULTS.md]

No noise, no wrong match, every tangential motion known: what is left is what the prior does not know of the hidden
part. Rows without and with the unit, for the whole splat and for cut ones; the truth gives matches and start. Writes
its part of RESULTS.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from case_inputs import CaseInputs, read_case
from measured import how
from results_file import write_part
from scipy.spatial import cKDTree
from stress import STRESSES

from organphys.elastic.elastic_registration import ElasticOptions, ElasticState
from organphys.elastic.joint_scale import ScalePrior, data_quadratic, solve
from organphys.elastic.matches import Matches
from organphys.elastic.reduced_organ import ReducedOrgan
from organphys.ground.frames import Similarity, fit_similarity
from organphys.pipeline.default_method import DefaultMethod

TITLE = "# Exact matches: what no data could better"
CUTS = ("25 % seen", "20 % seen", "15 % seen", "half seen")
WEIGHT = 2.0  # of all matches together: as much as both surface terms
REACH_MM = 4.0  # of a splat sample, within which a visible point still counts as seen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of case folders")
    parser.add_argument("--seeds", type=int, default=3, help="of the cuts")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("RESULTS.md"))
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.folder.glob("*/case.json"))
    rows: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for case in map(read_case, folders):
        for name, found in _runs(case, arguments.seeds):
            rows.setdefault(name, {}).setdefault(case.name, []).append(found)
    lines = ["| splat | mean | worst | surface seen, % | " + " | ".join(folder.name for folder in folders) + " |"]
    lines.append("|---" * (4 + len(folders)) + "|")
    for name, cases in rows.items():
        ratios = [float(np.mean([ratio for ratio, _ in found])) for found in cases.values()]
        shares = [100 * share for found in cases.values() for _, share in found]
        each = " | ".join(f"{ratio:.2f}" for ratio in ratios)
        lines.append(f"| {name} | {np.mean(ratios):.3f} | {max(ratios):.2f} | {np.mean(shares):.0f} | {each} |")
    command = f"python Testing/benchmarks/exact_matches.py {arguments.folder.name} --seeds {arguments.seeds}"
    about = "Mean TRE / oracle over the seeds per case, with the default's prior and basis; mean and worst over cases."
    table = "\n".join(lines)
    write_part(arguments.out, f"{TITLE}\n\n{how(command)}\n\n{about}\n\n{table}")
    print(table)


def _runs(case: CaseInputs, seeds: int) -> Iterator[tuple[str, tuple[float, float]]]:
    """Row by row: TRE / oracle, and the share of the surface's truth points that are seen."""
    organ: ReducedOrgan | None = None
    for name in ("whole", *CUTS):
        for seed in range(1 if name == "whole" else seeds):
            cut = case if name == "whole" else STRESSES[name](case, np.random.default_rng(seed))
            method = DefaultMethod(cut.case(seed=0, unit=False))
            organ = organ or method.organ
            near = cKDTree(method.view.T_camera_scene.inverse().apply(method.view.surface.samples))
            distance = near.query(case.truth.points_scene)[0] * case.truth.mm_per_unit
            seen = (case.truth.region == 0) & (distance < REACH_MM)
            share = float(seen.sum() / (case.truth.region < 2).sum())
            for unit in (False, True):
                yield name + (", unit known" if unit else ""), (exact_ratio(case, organ, seen, unit=unit), share)


def exact_ratio(case: CaseInputs, organ: ReducedOrgan, seen: np.ndarray, *, unit: bool) -> float:
    """TRE / oracle of the default's levels with the ``seen`` truth points (N,) alone."""
    truth, normalise = case.truth, organ.samples.normalisation.apply
    placed, rest = truth.points_scene[seen], normalise(truth.points_ct[seen])
    rows = cKDTree(organ.samples.points).query(rest)[1]
    beside = organ.samples.points[rows] - rest
    state = ElasticState(np.zeros((organ.basis.size, 3)), 1.0, fit_similarity(rest, placed))
    options = ElasticOptions()
    for level in options.levels:
        state = state.without_rigid_part(organ)
        prior = _exact_unit(state.start, organ.samples.normalisation.length / truth.mm_per_unit) if unit else None
        for _ in range(level.steps):
            targets = state.start.inverse().apply(placed) + beside / state.gamma
            none = np.zeros((len(rows), 3))
            matches = Matches(rows, targets, np.full(len(rows), WEIGHT / len(rows)), none, np.zeros(len(rows)))
            data = data_quadratic(organ, matches, organ.points(state.z), state.gamma, prior or ScalePrior())
            z, gamma, _ = solve(
                organ, data, level.alpha, level.loads, state.z, state.gamma, steps=options.inner_steps
            )  # fmt: skip
            state = ElasticState(z, gamma, state.start)
    points = normalise(truth.points_ct)
    return case.ratio(state.pose.apply(points + organ.basis.phi(points) @ state.z))


def _exact_unit(start: Similarity, true_scale: float) -> ScalePrior:
    return ScalePrior.of(start.scale / true_scale, 0)


if __name__ == "__main__":
    main()
