"""organphys demo: a sample case with known truth, registered, with the errors of every stage."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..exports.picture_sheet import write_picture_sheet
from .command_line import build_parser
from .commands_register import register_files
from .demo_pictures import stage_pictures
from .evaluation import REGIONS, mean_by_region, oracle_by_region, read_truth
from .output_folder import whole_or_nothing
from .registration import RegisterOptions, Registration
from .sample_case import SampleCase, write_sample_case
from .terminal_progress import shown_progress
from .write_outputs import write_outputs


def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for a folder that cannot be written."""
    folder = Path(arguments.out)
    RegisterOptions(seed=arguments.seed)  # a seed that cannot be used is found before anything is built
    with shown_progress(quiet=arguments.quiet) as progress, whole_or_nothing(folder) as stage:
        progress("build the sample case", 0.0)
        case = write_sample_case(stage / "case", seed=arguments.seed, size=arguments.size)
        options = build_parser().parse_args(["register", *_options(case), "--out", str(stage)])
        registration = register_files(options, progress)
        write_outputs(registration, stage)
        write_picture_sheet(stage / "stages.png", stage_pictures(registration))
        table = error_table(registration, case.truth)
    if not arguments.quiet:
        print(table)
        print(f"report:   {folder / 'report.html'}\npictures: {folder / 'stages.png'}")
        shown = _options(SampleCase(folder / "case", case.organ, case.mm_per_unit))
        print(f"the same by hand: organphys register {' '.join(shown)} --out DIR")


def error_table(registration: Registration, truth_path: Path) -> str:
    """Mean target registration error in mm after each stage, beside what the best possible similarity leaves."""
    truth = read_truth(truth_path)
    rows = {
        "coarse": mean_by_region(truth, registration.similarities["coarse"].apply(truth.points_ct)),
        "rigid": mean_by_region(truth, registration.similarities["rigid"].apply(truth.points_ct)),
        "elastic": mean_by_region(truth, registration.organ.map_points(truth.points_ct)),
        "best similarity*": oracle_by_region(truth),
    }
    names = ("all", *REGIONS)
    lines = ["target registration error, mean in mm:", " " * 18 + "".join(f"{name:>10s}" for name in names)]
    for stage, means in rows.items():
        lines.append(f"{stage:18s}" + "".join(f"{means.get(name, float('nan')):10.2f}" for name in names))
    return "\n".join([*lines, "* fitted to the truth: no rigid registration can do better on average"])


def _options(case: SampleCase) -> list[str]:
    return [
        *("--labels", str(case.labels)),
        *("--organ", "liver", "--label-scheme", "totalsegmentator"),
        *("--splat", str(case.splat)),
        *("--landmarks", str(case.landmarks)),
    ]
