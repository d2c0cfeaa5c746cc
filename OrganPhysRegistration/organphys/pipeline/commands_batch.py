"""organphys batch: a table of cases in, a folder per case and a summary of all out."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from ..ground.checks import InputError
from .batch_case import FAILED, KEPT, NOT_RUN, Outcome, Work, register_case
from .batch_cluster import cluster_client, local_client, need_dask, usual_workers
from .batch_folder import HIDDEN, CaseFolder
from .batch_run import run_cases, sweep
from .batch_summary import HTML, counts, write_summary
from .batch_table import BatchCase, read_batch
from .terminal_progress import shown_progress

if TYPE_CHECKING:
    from distributed import Client

SOME_FAILED = 3


def run(arguments: argparse.Namespace, *, work: Work = register_case) -> int:
    """The command with its parsed options; the exit code. InputError for a table or cluster that cannot be used."""
    need_dask()
    cases = read_batch(arguments.cases)
    out = _folder(arguments.out)
    outcomes: dict[str, Outcome] = {}
    try:
        with shown_progress(quiet=arguments.quiet) as progress, _client(arguments, out, len(cases)) as client:
            run_cases(cases, out, client, outcomes, work=work, progress=progress)
    except KeyboardInterrupt as stop:
        outcomes |= {case.name: _unasked(case, out) for case in cases if case.name not in outcomes}
        words = f"stopped; {counts(cases, outcomes)}; run the same command again to go on"
        raise KeyboardInterrupt(words) from stop
    finally:
        sweep(cases, out)
        if outcomes:
            write_summary(out, cases, outcomes)
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
        reason = error.strerror or str(error)
        raise InputError(f"{out}: cannot be written ({reason}); choose another output folder") from error
    return out


def _client(arguments: argparse.Namespace, out: Path, cases: int) -> AbstractContextManager[Client]:
    if arguments.scheduler is not None:
        return cluster_client(arguments.scheduler, out)
    return local_client(min(arguments.workers or usual_workers(), cases))


def _unasked(case: BatchCase, out: Path) -> Outcome:
    """Of a case that this run did not come to."""
    record = CaseFolder(out, case.name).record()
    return Outcome(NOT_RUN) if record is None else Outcome(KEPT, record["seconds"], record["result"])


def _told(cases: Sequence[BatchCase], outcomes: dict[str, Outcome], out: Path) -> str:
    failed = [(case, outcomes[case.name]) for case in cases if outcomes[case.name].status == FAILED]
    lines = [f"failed: {case.name} (line {case.line}): {outcome.error}" for case, outcome in failed]
    return "\n".join([*lines, counts(cases, outcomes), f"summary: {out / HTML}"])
