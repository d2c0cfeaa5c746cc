"""The options of organphys batch."""

from __future__ import annotations

import argparse
from typing import Any

from .command_options import _add_quiet

TABLE = (
    "The table has a header line and one line per case. Columns: case (name of the case's folder below --out), labels, "
    "organ and splat are needed; every other option of organphys register may be a column, named without the dashes: "
    "landmarks, splat_landmarks, roi, label_scheme, camera, fov, mm_per_unit, opacity, clean, no_opening, close_holes, "
    "method, stiffness, weights, seed. An empty cell is the default; clean, no_opening and close_holes are yes or no; "
    "camera is three numbers with spaces between. Paths are relative to the table's folder. Separated by commas, "
    "semicolons or tabs. The same command again goes on where the last one stopped: a case is finished when its folder "
    "is whole and was made from the same inputs and settings by the same version; failed cases are tried again."
)


def add_batch(commands: Any) -> None:
    """organphys batch"""
    parser = commands.add_parser(
        "batch",
        help="register many cases of a table, side by side",
        description="Registers every case of a table, each into a folder of its own, and writes summary.csv and "
        "summary.html with verdict, metrics, seconds and error of each case. Exit code 3: done, but cases failed. "
        'Needs Dask (pip install -c constraints.txt ".[batch]").',
        epilog=TABLE,
    )
    parser.add_argument("cases", metavar="CASES.csv", help="table of cases, see below")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder of the results; made if it is missing")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        type=_count,
        metavar="N",
        help="processes on this machine, each with one case at a time on about two cores and some GB of memory "
        "(default: half the cores)",
    )
    where.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask scheduler of a running cluster, say tcp://10.0.0.5:8786; its workers need this version of "
        "organphys and must see the inputs and --out under the same paths; start them with --nthreads 1",
    )
    _add_quiet(parser)


def _count(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1 to 1024, got {text!r}")
    return int(text)
