"""How often the start search ends in a wrong basin, and how long it takes: all cases of a folder, no landmarks.

    python Testing/benchmarks/start_search.py DIR [--seeds 10] [--stress NAME] [--out RESULTS.md]

A start has failed if its short elastic fit lies farther from the truth than the best possible similarity (the oracle),
or its rotation is more than 20 degrees from the oracle's. Writes its part of RESULTS.md.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np
from case_inputs import CaseInputs, read_case
from measured import how
from results_file import write_part
from stress import STRESSES

from organphys.elastic.mode_choice import choose_mode
from organphys.ground.frames import Similarity, fit_similarity, rotation_angle
from organphys.ground.progress import no_progress
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.organ_in_scene import organ_in_scene
from organphys.pipeline.processor import one_blas_thread

FARTHEST_DEG = 20.0


@dataclass(frozen=True)
class Start:
    """Of one case and seed: seconds of search and choice, the short fit's TRE / oracle, degrees from the oracle's
    rotation, the score and that of the best pose elsewhere (inf if there is none)."""

    search_s: float
    choice_s: float
    ratio: float
    degrees: float
    score: float
    runner_up: float

    @property
    def failed(self) -> bool:
        return self.ratio > 1.0 or self.degrees > FARTHEST_DEG


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of case folders")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--stress", choices=tuple(STRESSES), help="make the cases harder first")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("RESULTS.md"))
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.folder.glob("*/case.json"))
    if not folders:
        parser.error(f"no cases in {arguments.folder}")
    starts: dict[str, list[Start]] = {}
    for folder in folders:
        case = replace(read_case(folder), landmarks=None)
        starts[folder.name] = [found(case, seed, arguments.stress) for seed in range(arguments.seeds)]
        print(f"{folder.name}: {sum(s.failed for s in starts[folder.name])} failures", file=sys.stderr, flush=True)
    command = f"python Testing/benchmarks/start_search.py {shlex.join(sys.argv[1:])}"
    title = "# Start search without landmarks" + (f", {arguments.stress}" if arguments.stress else "")
    write_part(arguments.out, f"{title}\n\n{how(command)}\n\n{_explained()}\n\n{table(starts)}\n")
    print(table(starts))


@one_blas_thread
def found(inputs: CaseInputs, seed: int, stress: str | None) -> Start:
    """Search and choice of the mode with one seed; everything that does not belong to them is made before."""
    if stress is not None:
        inputs = STRESSES[stress](inputs, np.random.default_rng(seed))
    case = inputs.case(seed=seed, unit=False)
    method = DefaultMethod(organ_in_scene(case) if inputs.box is None else case)
    organ, view = method.rough_organ, method.view
    begin = perf_counter()
    starts = method.coarse(no_progress).starts
    searched = perf_counter()
    modes = choose_mode(organ, view, starts.modes().poses, landmarks=method.landmarks)
    chosen = perf_counter()
    state, runner_up = modes.states[0], modes.runner_up(organ)
    normalised = method.samples.normalisation.apply(inputs.truth.points_ct)
    bent = state.pose.apply(normalised + organ.basis.phi(normalised) @ state.z)
    T_camera_ct = modes.best @ method.samples.normalisation.T_ct_normalised.inverse()
    return Start(
        search_s=searched - begin,
        choice_s=chosen - searched,
        ratio=inputs.ratio(view.T_camera_scene.inverse().apply(bent)),
        degrees=_degrees(view.T_camera_scene.inverse() @ T_camera_ct, inputs),
        score=modes.scores[0].total,
        runner_up=np.inf if runner_up is None else runner_up.score.total,
    )


def _degrees(T_scene_ct: Similarity, inputs: CaseInputs) -> float:
    """Angle between a pose's rotation and the oracle's."""
    oracle = fit_similarity(inputs.truth.points_ct, inputs.truth.points_scene)
    return float(np.degrees(rotation_angle(T_scene_ct.rotation, oracle.rotation)))


def _explained() -> str:
    return (
        "Failed: the short elastic fit of the chosen pose has a mean TRE above the oracle's, or its rotation is more "
        f"than {FARTHEST_DEG:.0f} degrees off. Score: two-way misfit and bending of the short fit, no unit; the "
        "runner-up is the best pose clearly elsewhere (- : none came near). Search: the global search alone."
    )


def table(starts: dict[str, Sequence[Start]]) -> str:
    """A line per case, then all of them."""
    lines = [
        "| case | failures | worst TRE / oracle | worst rotation, degrees | score, worst | runner-up / score, least | "
        "search s, median (max) | choice s, median |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    everything = [start for found in starts.values() for start in found]
    for name, group in (*starts.items(), ("**all**", everything)):
        rivals = [s.runner_up / s.score for s in group if np.isfinite(s.runner_up)]
        search = [s.search_s for s in group]
        lines.append(
            f"| {name} | {sum(s.failed for s in group)} of {len(group)} | {max(s.ratio for s in group):.2f} | "
            f"{max(s.degrees for s in group):.0f} | {max(s.score for s in group):.2f} | "
            f"{f'{min(rivals):.2f}' if rivals else '-'} | {np.median(search):.2f} ({max(search):.2f}) | "
            f"{np.median([s.choice_s for s in group]):.2f} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    main()
