"""organphys batch: a table of cases in, a folder per case and a summary of all out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ..ground.atomic_file import unwritable
from ..ground.checks import InputError
from .batch_case import register_case
from .batch_cluster import batch_client, need_dask
from .batch_folder import HIDDEN, CaseFolder
from .batch_records import FAILED, KEPT, NOT_RUN, BatchCase, Outcome, Work
from .batch_run import run_cases, sweep
from .batch_summary import HTML, counts, write_summary
from .batch_table import read_batch
from .terminal_progress import shown_progress

SOME_FAILED = 3


def run(arguments: argparse.Namespace, *, work: Work = register_case) -> int:
    """The command with its parsed options; the exit code. InputError for a table or cluster that cannot be used."""
    need_dask()
    cases = read_batch(arguments.cases)
    out = _folder(arguments.out)
    outcomes: dict[str, Outcome] = {}
    try:
        with (
            shown_progress(quiet=arguments.quiet) as progress,
            batch_client(arguments.scheduler, arguments.workers, out, len(cases)) as client,
        ):
            run_cases(cases, out, client, outcomes, work=work, progress=progress)
    except KeyboardInterrupt as stop:
        outcomes |= {case.name: _unasked(case, out) for case in cases if case.name not in outcomes}
        words = f"stopped; {counts(cases, outcomes)}; run the same command again to go on"
        raise KeyboardInterrupt(words) from stop
    finally:
        sweep(cases, out)
        if outcomes:
            write_summary(out, cases, outcomes)
        else:
            _remove_empty(out)
    if not arguments.quiet:
        print(_told(cases, outcomes, out))
    return SOME_FAILED if any(outcome.status == FAILED for outcome in outcomes.values()) else 0


def _folder(name: str) -> Path:
    """The folder of the results, absolute, made and found to be writable."""
    if not name.strip():
        raise InputError("output folder: no name given; name a folder for the results")
    out = Path(name).absolute()
    try:
        (out / HIDDEN).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(out, error) from error
    return out


def _remove_empty(out: Path) -> None:
    """A folder in which nothing came about is not left behind; one that holds something stays."""
    with suppress(OSError):
        (out / HIDDEN).rmdir()
        out.rmdir()


def _unasked(case: BatchCase, out: Path) -> Outcome:
    """Of a case that this run did not come to."""
    record = CaseFolder(out, case.name).record()
    return Outcome(NOT_RUN) if record is None else Outcome(KEPT, record["seconds"], record["result"])


def _told(cases: Sequence[BatchCase], outcomes: dict[str, Outcome], out: Path) -> str:
    failed = [(case, outcomes[case.name]) for case in cases if outcomes[case.name].status == FAILED]
    lines = [f"failed: {case.name} (line {case.line}): {outcome.error}" for case, outcome in failed]
    return "\n".join([*lines, counts(cases, outcomes), f"summary: {out / HTML}"])
