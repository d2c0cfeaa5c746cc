"""organphys-bench: methods x cases against known truth, as JSON and one HTML page.

    organphys-bench --cases DIR [--methods rigid_icp,organphys] [--out DIR] [--full]

DIR holds case folders (case.json, ct_labels.nii.gz, splat.ply, landmarks.mrk.json, truth.npz). Runs that are finished
are kept in OUT/runs and not repeated; remove a file there to run it again. --full adds sweeps over landmarks, noise,
outliers and the share of the organ that is seen; it takes hours and goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import os
import sys
from importlib.util import find_spec
from pathlib import Path

from organphys.ground.checks import InputError

from . import SCRIPTS
from .peers.methods import METHODS
from .runs.case_folders import case_folders
from .runs.conditions import Condition, full_conditions
from .runs.pool import run_all
from .runs.run_file import RunKey, read_runs

EXTRA = {"pycpd": "pycpd", "trimesh": "trimesh", "pytetwild": "pytetwild", "pyvista": "pyvista", "meshio": "meshio"}
USUAL = ",".join(name for name in METHODS if name != "fem_icp_fine")  # which takes as long as several others
NO_SWEEP = ("paper_figure_8", "fem_icp_fine")


def main(arguments: list[str] | None = None) -> None:
    """Exit status 2 with one line for what the user can mend."""
    options = parser().parse_args(arguments)
    try:
        check_installed()
        run(options)
    except InputError as error:
        print(f"organphys-bench: {error}", file=sys.stderr)
        sys.exit(2)


def parser() -> argparse.ArgumentParser:
    found = argparse.ArgumentParser(
        prog="organphys-bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    found.add_argument("--cases", type=Path, required=True, help="folder of case folders")
    found.add_argument("--methods", default=USUAL, help=f"of {', '.join(METHODS)} (default: {USUAL})")
    found.add_argument("--only", default="", help="names of cases, separated by commas (default: all)")
    found.add_argument("--out", type=Path, default=Path("organphys-bench"), help="where runs and report go")
    found.add_argument("--full", action="store_true", help="sweeps too")
    found.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="runs at a time (default: the cores)")
    found.add_argument("--results", type=Path, help="also write the main table as a part of this Markdown file")
    found.add_argument("--report-only", action="store_true", help="report on what has run, run nothing")
    return found


def check_installed() -> None:
    """InputError where the extra "bench" or the checkout that this package belongs to is not there."""
    missing = [name for name, module in EXTRA.items() if find_spec(module) is None]
    if missing:
        raise InputError(f"{', '.join(missing)} not installed: pip install -e '.[bench]' in a checkout of OrganPhys")
    if not (SCRIPTS / "case_inputs.py").exists():
        raise InputError("this runs from a checkout of OrganPhys only: pip install -e '.[bench]' there")


def run(options: argparse.Namespace) -> None:
    """Run what is missing, then write the report."""
    from .report.write_report import write_report

    cases = case_folders(options.cases, frozenset(filter(None, options.only.split(","))))
    keys = planned(list(cases), chosen_methods(options.methods), full=options.full)
    if not options.report_only:
        run_all(keys, cases, options.out, jobs=max(1, options.jobs), tell=lambda line: print(line, flush=True))
    wanted = {(key.case, key.method, key.condition.text) for key in keys}
    runs = [run for run in read_runs(options.out) if (run["case"], run["method"], _text(run)) in wanted]
    if not runs:
        raise InputError(f"--report-only: nothing has run in {options.out}")
    some = "" if options.methods == USUAL else f" --methods {options.methods}"
    command = f"organphys-bench --cases {options.cases.name}{some}{' --full' if options.full else ''}"
    for path in write_report(runs, cases, options.out, command=command, results=options.results):
        print(path)


def chosen_methods(text: str) -> list[str]:
    """Names, in the order of METHODS; InputError for one that does not exist."""
    names = set(filter(None, text.split(",")))
    if unknown := names - set(METHODS):
        raise InputError(f"--methods: no method {', '.join(sorted(unknown))}; there are {', '.join(METHODS)}")
    return [name for name in METHODS if name in names]


def planned(cases: list[str], methods: list[str], *, full: bool) -> list[RunKey]:
    """The baseline first, method by method, then the sweeps: what has run when it is stopped makes whole tables."""
    conditions = [Condition(), *(full_conditions() if full else ())]
    return [
        RunKey(case, method, condition)
        for condition in conditions
        for method in methods
        for case in cases
        if condition == Condition() or method not in NO_SWEEP
    ]


def _text(run: dict) -> str:
    return Condition(**run["condition"]).text
