"""organphys demo: a sample case with known truth, registered, with the errors of every stage, and then grasped."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..exports.picture_sheet import write_picture_sheet
from ..exports.report_content import ReportTable
from .command_line import build_parser
from .commands_register import register_files
from .demo_pictures import stage_pictures
from .demo_simulation import demo_grasp
from .evaluation import REGIONS, mean_by_region, oracle_by_region, read_truth
from .output_folder import whole_or_nothing
from .processor import one_blas_thread
from .registration import RegisterOptions, Registration
from .sample_case import SampleCase, write_sample_case
from .terminal_progress import shown_progress
from .write_outputs import write_outputs


@one_blas_thread
def run(arguments: argparse.Namespace) -> None:
    """The command with its parsed options; InputError for a folder that cannot be written."""
    folder = Path(arguments.out)
    RegisterOptions(seed=arguments.seed)  # a seed that cannot be used is found before anything is built
    with shown_progress(quiet=arguments.quiet) as progress, whole_or_nothing(folder) as stage:
        progress("build the sample case", 0.0)
        case = write_sample_case(stage / "case", seed=arguments.seed, size=arguments.size)
        options = build_parser().parse_args(["register", *_options(case), "--out", str(stage)])
        registration = register_files(options, progress)
        table = error_table(registration, case.truth)
        rows, strip = demo_grasp(registration.organ, case.splat, progress)
        progress("write the report", 0.0)
        write_outputs(registration, stage, extra_tables=(table,), extra_strips=(strip,))
        write_picture_sheet(stage / "stages.png", stage_pictures(registration))
        write_picture_sheet(stage / "grasp.png", rows)
    if not arguments.quiet:
        print(_as_text(table))
        print(f"report:   {folder / 'report.html'}\npictures: {folder / 'stages.png'}, {folder / 'grasp.png'}")
        shown = _options(SampleCase(folder / "case", case.organ, case.mm_per_unit))
        print(f"the same by hand: organphys register {' '.join(shown)} --out DIR")
        print(f"and: organphys simulate {folder / 'organ.organphys'} --splat {folder / 'case' / 'splat.ply'} --out DIR")


def error_table(registration: Registration, truth_path: Path) -> ReportTable:
    """Mean target registration error in mm after each stage, beside what the best possible similarity leaves."""
    truth = read_truth(truth_path)
    mapped = {stage: registration.similarities[stage].apply(truth.points_ct) for stage in ("coarse", "rigid")}
    mapped["elastic"] = registration.organ.map_points(truth.points_ct)
    rows = {stage: mean_by_region(truth, points) for stage, points in mapped.items()}
    rows["best similarity*"] = oracle_by_region(truth)
    names = ("all", *REGIONS)
    return ReportTable(
        title="Target registration error against the known truth, mean in mm",
        columns=("stage", *names),
        rows=[(stage, *(means.get(name, float("nan")) for name in names)) for stage, means in rows.items()],
        note="* fitted to the truth: no registration that is only rigid and scaled does better on average",
    )


def _as_text(table: ReportTable) -> str:
    lines = [f"{table.title}:", f"{table.columns[0]:18s}" + "".join(f"{name:>10s}" for name in table.columns[1:])]
    lines += [f"{name:18s}" + "".join(f"{value:10.2f}" for value in values) for name, *values in table.rows]
    return "\n".join([*lines, table.note])


def _options(case: SampleCase) -> list[str]:
    return [
        *("--labels", str(case.labels)),
        *("--organ", "liver", "--label-scheme", "totalsegmentator"),
        *("--splat", str(case.splat)),
        *("--landmarks", str(case.landmarks)),
    ]
