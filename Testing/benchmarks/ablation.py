"""The elastic stage with other settings, over all cases of a folder and several seeds, against known truth.

    python Testing/benchmarks/ablation.py DIR [--seeds 3] [--sets NAME,...] [--stress NAME,...]

Every set without and with the unit, then the default under each stress; prints the table and writes it as its part of
RESULTS.md: of the default alone (--sets default) a part of its own, one with stress and one without. The start of a
case and seed is found once and shared by the sets; the truth serves the evaluation (and the unit, where it is given).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from ablation_sets import SETS, Settings
from case_inputs import CaseInputs, read_case
from measured import how
from results_file import write_part
from stress import STRESSES

from organphys.elastic.elastic_registration import register_elastically
from organphys.elastic.joint_scale import ScalePrior
from organphys.elastic.reduced_organ import reduce_organ
from organphys.ground.frames import Similarity
from organphys.ground.progress import no_progress
from organphys.pipeline.default_method import DefaultMethod
from organphys.pipeline.organ_in_scene import organ_in_scene
from organphys.pipeline.scale_checks import scale_prior, unit_scale

Result = tuple[float, float]
TITLE = "# Ablation of the elastic stage"
STRESS_TITLE = "# The default under stress"
SEEDS_TITLE = "# The default over seeds"
ABOUT = "Mean TRE / oracle over the seeds per case; mean and worst over the cases."


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of case folders")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--sets", default=",".join(SETS), help=f"rows of the table: {', '.join(SETS)}")
    parser.add_argument("--stress", default="", help=f"all, or some of: {', '.join(STRESSES)}".replace("%", "%%"))
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("RESULTS.md"), help="table to write")
    arguments = parser.parse_args()
    folders = sorted(path.parent for path in arguments.folder.glob("*/case.json"))
    if not folders:
        parser.error(f"no cases in {arguments.folder}")
    if unknown := [name for name in arguments.sets.split(",") if name not in SETS]:
        parser.error(f"no set {unknown[0]!r}; there are: {', '.join(SETS)}")
    sets = {name: SETS[name] for name in arguments.sets.split(",")}
    chosen = list(STRESSES) if arguments.stress == "all" else list(filter(None, arguments.stress.split(",")))
    rows: dict[str, list[list[Result]]] = {}
    for folder in folders:
        case = read_case(folder)
        for seed in range(arguments.seeds):
            for name, result in _runs(case, sets, chosen, seed):
                rows.setdefault(name, [[] for _ in folders])[folders.index(folder)].append(result)
        print(f"{folder.name} done", file=sys.stderr, flush=True)
    table = _table(rows, [folder.name for folder in folders])
    command = f"python Testing/benchmarks/ablation.py {arguments.folder.name} --seeds {arguments.seeds}"
    command += f" --sets '{arguments.sets}'" + (f" --stress '{arguments.stress}'" if arguments.stress else "")
    title = TITLE if len(sets) > 1 else STRESS_TITLE if chosen else SEEDS_TITLE
    about = f"{ABOUT} One setting changed at a time." if len(sets) > 1 else ABOUT
    write_part(arguments.out, f"{title}\n\n{how(command)}\n\n{about}\n\n{table}")
    print(table)


def _runs(
    case: CaseInputs, sets: dict[str, Settings], stresses: Sequence[str], seed: int
) -> Iterator[tuple[str, Result]]:
    """Row by row, the result of one case and one seed."""
    for unit in (False, True):
        fit = Fit(case, seed=seed, unit=unit)
        for name, settings in sets.items():
            yield name + (", unit known" if unit else ""), fit.result(settings)
    for name in stresses:
        harder = STRESSES[name](case, np.random.default_rng(seed))
        yield name, Fit(harder, seed=seed, unit=False).result(Settings())


class Fit:
    """The stages up to the choice of the mode, made once for all settings."""

    def __init__(self, inputs: CaseInputs, *, seed: int, unit: bool) -> None:
        self.inputs, self.seed = inputs, seed
        case = inputs.case(seed=seed, unit=unit)
        self.method = DefaultMethod(organ_in_scene(case) if inputs.box is None else case)
        self.start = self.method.rigid(self.method.coarse(no_progress), None, no_progress).pose

    def result(self, settings: Settings) -> Result:
        """Ratio of the mean TRE to the oracle's, and scale error in percent."""
        method, truth = self.method, self.inputs.truth
        organ = method.organ
        if settings.basis is not None:
            organ = reduce_organ(self.inputs.organ, method.samples, options=settings.basis, seed=self.seed)
        prior = self._scale_of_start if settings.scale_held else self._scale_prior
        state, _ = register_elastically(
            organ, settings.view(method.view), self.start, scale_prior=prior, options=settings.elastic
        )
        normalised = method.samples.normalisation.apply(truth.points_ct)
        mapped = state.pose.apply(normalised + organ.basis.phi(normalised) @ state.z)
        mapped = method.view.T_camera_scene.inverse().apply(mapped)
        scale = state.without_rigid_part(organ).pose.scale / method.samples.normalisation.length
        return self.inputs.ratio(mapped), 100 * (scale * truth.mm_per_unit - 1)

    def _scale_prior(self, start: Similarity) -> ScalePrior:
        unit = self.method.case.unit
        return scale_prior(start, unit_scale(unit, self.method.samples), unit)

    def _scale_of_start(self, start: Similarity) -> ScalePrior:
        return ScalePrior.of(start.scale / self.start.scale, 0)


def _table(rows: dict[str, list[list[Result]]], names: Sequence[str]) -> str:
    """Mean over the seeds per case, then mean and worst over the cases, and the rms scale error."""
    lines = [["setting", "mean", "worst", "scale error %, rms", *names]]
    lines.append(["---"] * len(lines[0]))
    for name, cases in rows.items():
        ratios = [float(np.mean([ratio for ratio, _ in results])) for results in cases]
        scale = np.sqrt(np.mean([error**2 for results in cases for _, error in results]))
        cells = [f"{np.mean(ratios):.3f}", f"{max(ratios):.2f}", f"{scale:.1f}", *(f"{ratio:.2f}" for ratio in ratios)]
        lines.append([name, *cells])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


if __name__ == "__main__":
    main()
