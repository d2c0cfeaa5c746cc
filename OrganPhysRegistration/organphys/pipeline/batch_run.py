"""Many cases on Dask: every worker thread gets one at a time, and what a dead worker has lost is given to another."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from .batch_case import BUSY, FAILED, Outcome, Work, register_case, work_case
from .batch_folder import CaseFolder
from .batch_lock import case_lock
from .batch_table import BatchCase

if TYPE_CHECKING:
    from distributed import Client, Future

LOST = "lost the Dask scheduler; what is finished is kept: run the same command again to go on"
_LOOK_S = 1.0  # how often new workers are looked for


def run_cases(
    cases: Sequence[BatchCase],
    out: Path,
    client: Client,
    outcomes: dict[str, Outcome],
    *,
    work: Work = register_case,
    progress: Progress = no_progress,
) -> None:
    """Do ``cases`` on the workers of ``client``; ``outcomes``, by the case's name, grows as they end.

    No more cases are handed out than there are worker threads, so that a worker that dies takes one case with it and
    the blame for its death falls on that one. A case that another batch is at is asked for again at the end.
    InputError when the scheduler is gone.
    """
    from distributed.client import FutureCancelledError

    waiting, running, held = deque(cases), dict[Future, BatchCase](), list[BatchCase]()
    patient = False
    try:
        while waiting or running or held:
            if not waiting and not running:
                waiting, held, patient = deque(held), [], True
            _hand_out(waiting, running, client, out, work, patient)
            for future in _ended(running):
                case, outcome = running.pop(future), _outcome(future)
                if outcome.status == BUSY:
                    held.append(case)
                else:
                    outcomes[case.name] = outcome
            progress(_words(len(cases), outcomes), len(outcomes) / len(cases))
    except (OSError, FutureCancelledError) as error:
        raise InputError(LOST) from error
    finally:
        for future in running:
            future.cancel(force=True)


def sweep(cases: Iterable[BatchCase], out: Path) -> None:
    """Remove what dead workers have left of cases that no one is at."""
    for case in cases:
        folder = CaseFolder(out, case.name)
        if folder.part.exists() or folder.old.exists():
            with case_lock(folder.lock, wait=False) as held:
                if held:
                    folder.mend()


def _hand_out(
    waiting: deque[BatchCase], running: dict[Future, BatchCase], client: Client, out: Path, work: Work, patient: bool
) -> None:
    """As many cases as there are free worker threads."""
    room = sum(client.nthreads().values()) - len(running)
    for _ in range(min(room, len(waiting))):
        case = waiting.popleft()
        key = f"{case.name}-{uuid4().hex}"
        running[client.submit(work_case, case, out, work, wait=patient, key=key, pure=False)] = case


def _ended(running: dict[Future, BatchCase]) -> list[Future]:
    """Those that ended, after a second at most."""
    from distributed import TimeoutError as NoneYet
    from distributed import wait

    try:
        wait(list(running), timeout=_LOOK_S, return_when="FIRST_COMPLETED")
    except NoneYet:
        return []
    return [future for future in running if future.done()]


def _outcome(future: Future) -> Outcome:
    """The outcome that the worker returned, or why there is none."""
    from distributed import KilledWorker

    error = future.exception()
    if error is None:
        result: Outcome = future.result()
        return result
    if isinstance(error, KilledWorker):
        count = error.allowed_failures + 1
        return Outcome(
            FAILED,
            error=f"its worker process died, {count} times; if memory ran out, crop the inputs or take fewer --workers",
        )
    return Outcome(FAILED, error=f"{type(error).__name__}: {' '.join(str(error).split())}")


def _words(count: int, outcomes: dict[str, Outcome]) -> str:
    failed = sum(outcome.status == FAILED for outcome in outcomes.values())
    return f"{len(outcomes)} of {count} cases" + (f", {failed} failed" if failed else "")
