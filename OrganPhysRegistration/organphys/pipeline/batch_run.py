"""Many cases on Dask: every worker thread gets one at a time, and what a dead worker has lost is asked for again."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from .batch_case import register_case, work_case
from .batch_cluster import refill
from .batch_folder import CaseFolder
from .batch_lock import case_lock
from .batch_records import BUSY, DIED, FAILED, BatchCase, Outcome, Work

if TYPE_CHECKING:
    from distributed import Client, Future

LOST = "lost the Dask scheduler; what is finished is kept: run the same command again to go on"
DEADLY = (
    "its worker process died twice, the second time with no other case beside it; if memory ran out, crop the inputs"
)
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

    At the end the cases that another batch held are waited for; then those whose worker died are tried again, one at a
    time: a case that takes its worker along a second time, alone, has failed. InputError when the scheduler is gone.
    """
    from distributed.client import FutureCancelledError

    board = _Board(client, out, work, deque(cases))
    try:
        while board.goes_on():
            board.hand_out()
            for case, outcome in board.ended():
                outcomes[case.name] = outcome
            progress(_words(len(cases), outcomes), len(outcomes) / len(cases))
    except (OSError, FutureCancelledError) as error:
        raise InputError(LOST) from error
    finally:
        for future in board.running:
            future.cancel(force=True)


def sweep(cases: Iterable[BatchCase], out: Path) -> None:
    """Remove what dead workers have left of cases that no one is at."""
    for case in cases:
        folder = CaseFolder(out, case.name)
        if folder.part.exists() or folder.old.exists():
            with case_lock(folder.lock, wait=False) as held:
                if held:
                    folder.mend()


@dataclass
class _Board:
    """Who is at what. ``patient``: cases that another batch holds are waited for; ``alone``: one case at a time."""

    client: Client
    out: Path
    work: Work
    waiting: deque[BatchCase]
    running: dict[Future, BatchCase] = field(default_factory=dict)
    held: list[BatchCase] = field(default_factory=list)
    suspects: list[BatchCase] = field(default_factory=list)
    patient: bool = False
    alone: bool = False

    def goes_on(self) -> bool:
        """False when nothing is left; before that the next round begins when one is over."""
        if self.waiting or self.running:
            return True
        if self.held:
            self.waiting, self.held, self.patient = deque(self.held), [], True
        elif self.suspects:
            self.waiting, self.suspects, self.patient, self.alone = deque(self.suspects), [], True, True
        return bool(self.waiting)

    def hand_out(self) -> None:
        """No more cases than there are worker threads, so that a worker takes few along when it dies."""
        threads = sum(self.client.nthreads().values())
        refill(self.client, threads)
        room = 1 if self.alone else threads
        while self.waiting and len(self.running) < room:
            case = self.waiting.popleft()
            key = f"{case.name}-{uuid4().hex}"
            arguments = (case, self.out, self.work)
            self.running[self.client.submit(work_case, *arguments, wait=self.patient, key=key, pure=False)] = case

    def ended(self) -> list[tuple[BatchCase, Outcome]]:
        """What has ended for good, after a second at most."""
        found = [(self.running.pop(future), _outcome(future)) for future in _first_ended(self.running)]
        self.held += [case for case, outcome in found if outcome.status == BUSY]
        died = [case for case, outcome in found if outcome.status == DIED]
        if not self.alone:
            self.suspects += died
            died = []
        return [(case, outcome) for case, outcome in found if outcome.status not in (BUSY, DIED)] + [
            (case, Outcome(FAILED, error=DEADLY)) for case in died
        ]


def _first_ended(running: dict[Future, BatchCase]) -> list[Future]:
    from distributed import TimeoutError as NoneYet
    from distributed import wait

    try:
        wait(list(running), timeout=_LOOK_S, return_when="FIRST_COMPLETED")
    except NoneYet:
        return []
    return [future for future in running if future.done()]


def _outcome(future: Future) -> Outcome:
    """What the worker returned, or why there is nothing."""
    from distributed import KilledWorker

    error = future.exception()
    if error is None:
        result: Outcome = future.result()
        return result
    if isinstance(error, KilledWorker):
        return Outcome(DIED)
    return Outcome(FAILED, error=f"{type(error).__name__}: {' '.join(str(error).split())}")


def _words(count: int, outcomes: dict[str, Outcome]) -> str:
    failed = sum(outcome.status == FAILED for outcome in outcomes.values())
    return f"{len(outcomes)} of {count} cases" + (f", {failed} failed" if failed else "")
