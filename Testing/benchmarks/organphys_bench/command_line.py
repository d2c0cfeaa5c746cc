"""organphys-bench: methods x cases against known truth, as JSON and one HTML page.

    organphys-bench --cases DIR [--methods rigid_icp,organphys] [--out DIR] [--full] [--minutes M]

DIR holds case folders (case.json, ct_labels.nii.gz, splat.ply, landmarks.mrk.json, truth.npz). Runs that are finished
are kept in OUT/runs and not repeated; remove a file there to run it again. The report is of all that OUT holds of these
cases. --full adds sweeps over landmarks, noise, outliers and the share of the organ that is seen; it takes hours, or
--minutes of them at a time, and goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import os
import sys
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from organphys.ground.checks import InputError

from . import SCRIPTS
from .peers.methods import METHODS
from .runs.case_folders import case_folders
from .runs.conditions import SWEEPS, Condition, full_conditions
from .runs.pool import run_all
from .runs.run_file import RunKey, read_runs

EXTRA = {"pycpd": "pycpd", "trimesh": "trimesh", "pytetwild": "pytetwild", "pyvista": "pyvista", "meshio": "meshio"}
USUAL = ",".join(name for name in METHODS if name != "fem_icp_fine")  # which takes as long as several others
SWEPT = "rigid_icp,similarity_icp,coherent_drift,amberg,organphys"  # the others take 10 to 30 s a run


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
    found.add_argument("--sweeps", default=",".join(SWEEPS), help=f"which, of {', '.join(SWEEPS)} (default: all)")
    found.add_argument("--sweep-methods", default=SWEPT, help=f"which methods the sweeps run (default: {SWEPT})")
    found.add_argument("--sweep-cases", default="", help="which cases the sweeps run (default: all)")
    found.add_argument("--seeds", type=int, default=10, help="run at most so many seeds in the sweeps (default: all)")
    found.add_argument("--fresh", action="store_true", help="run again what has run already")
    found.add_argument("--minutes", type=float, help="begin no run later than this (default: no limit)")
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

    every = case_folders(options.cases)
    keys = planned(options, every)
    if not options.report_only:
        for key in keys if options.fresh else ():
            key.path(options.out).unlink(missing_ok=True)
        jobs = max(1, options.jobs)
        run_all(keys, every, options.out, jobs=jobs, minutes=options.minutes, tell=partial(print, flush=True))
    runs = [run for run in read_runs(options.out) if run["case"] in every]
    if not runs:
        raise InputError(f"nothing has run in {options.out}")
    swept = any(run["condition"] != vars(Condition()) for run in runs)
    command = f"organphys-bench --cases {options.cases.name}{' --full' if swept else ''}"
    for path in write_report(runs, every, options.out, command=command, results=options.results):
        print(path)


def chosen_cases(text: str, every: list[str]) -> list[str]:
    """Names, all for an empty text; InputError for one that does not exist."""
    return _chosen(text or ",".join(every), every, "case")


def chosen_sweeps(text: str) -> list[str]:
    """Names of sweeps; InputError for one that does not exist."""
    return _chosen(text, list(SWEEPS), "sweep")


def chosen_methods(text: str) -> list[str]:
    """Names, in the order of METHODS; InputError for one that does not exist."""
    return _chosen(text, list(METHODS), "method")


def _chosen(text: str, known: list[str], kind: str) -> list[str]:
    """Those of ``known`` that ``text`` names, separated by commas, in the order of ``known``."""
    names = set(filter(None, text.split(",")))
    if unknown := names - set(known):
        raise InputError(f"no {kind} {', '.join(sorted(unknown))}; there are {', '.join(known)}")
    return [name for name in known if name in names]


def planned(options: argparse.Namespace, every: dict[str, Path]) -> list[RunKey]:
    """The baseline first, method by method, then the sweeps, one seed of everything after the other, quick methods
    before slow ones: what has run when it is stopped makes whole tables and curves."""
    cases, swept = (chosen_cases(text, list(every)) for text in (options.only, options.sweep_cases))
    keys = [RunKey(case, method, Condition()) for method in chosen_methods(options.methods) for case in cases]
    if options.full:
        conditions, methods = full_conditions(chosen_sweeps(options.sweeps)), chosen_methods(options.sweep_methods)
        conditions = [condition for condition in conditions if condition.seed < options.seeds]
        cases = [case for case in cases if case in swept]
        keys += sweep_keys(conditions, cases, methods)
    return keys


def sweep_keys(conditions: list[Condition], cases: list[str], methods: list[str]) -> list[RunKey]:
    """In the order of the conditions' seeds, then of how many seeds the methods run; neighbours: one case and
    condition, several methods."""
    order = sorted({condition.seed for condition in conditions})
    ranks = sorted({METHODS[method].sweep_seeds for method in methods}, reverse=True)
    return [
        RunKey(case, method, condition)
        for seed in order
        for rank in ranks
        for condition in conditions
        for case in cases
        for method in methods
        if condition.seed == seed < rank == METHODS[method].sweep_seeds
    ]
