"""Where a batch runs: worker processes on this machine, or the workers of a Dask cluster that is there already."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from .. import __version__
from ..ground.atomic_file import write_text
from ..ground.checks import InputError
from .batch_folder import HIDDEN

if TYPE_CHECKING:
    from distributed import Client

MISSING = 'batch: needs Dask, which is not installed; pip install -c constraints.txt ".[batch]"'
LOST_S = 120  # after which a dead worker's nanny is given up; Dask's 15 s are too few to restart on a busy machine
_ANSWER_S, _WORKERS_S, _CLOSE_S = 10, 60, 5


def need_dask() -> None:
    """InputError where the optional packages are missing."""
    if any(find_spec(name) is None for name in ("dask", "distributed")):
        raise InputError(MISSING)


def usual_workers() -> int:
    """Half the cores that this process may use: a registration takes about two."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, cores // 2)


def batch_client(scheduler: str | None, workers: int | None, out: Path, cases: int) -> AbstractContextManager[Client]:
    """A client of the scheduler at that address if one is given, else of new worker processes of this machine."""
    if scheduler is not None:
        return cluster_client(scheduler, out)
    return local_client(min(workers or usual_workers(), cases))


@contextmanager
def local_client(workers: int) -> Iterator[Client]:
    """Worker processes of this machine, one thread each, ended with the block; they are reached on 127.0.0.1 only."""
    import dask
    from distributed import Client, LocalCluster

    with dask.config.set({
        "distributed.scheduler.allowed-failures": 0,
        "distributed.deploy.lost-worker-timeout": LOST_S,
    }):  # fmt: skip
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",  # any free port: the usual one may be taken
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        )
        client = Client(cluster)
        try:
            client.register_plugin(_deaf_to_interrupts())
            yield client
        finally:
            client.close(timeout=_CLOSE_S)
            cluster.close(timeout=_CLOSE_S)


def refill(client: Client, threads: int) -> None:
    """Start workers of this machine anew that are gone for good; of other clusters someone else takes care."""
    cluster = client.cluster
    if cluster is not None and threads < len(cluster.worker_spec):
        cluster.scale(len(cluster.worker_spec))


def _deaf_to_interrupts() -> Any:
    """A terminal sends Ctrl-C to the workers too; it is for the command, which ends them."""
    from distributed import WorkerPlugin

    class DeafToInterrupts(WorkerPlugin):  # type: ignore[misc]
        def setup(self, worker: Any) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    return DeafToInterrupts()


@contextmanager
def cluster_client(address: str, out: Path) -> Iterator[Client]:
    """A client of the scheduler at ``address``.

    InputError where it does not answer, has no workers, or where these have another organphys or do not see ``out``.
    """
    from distributed import Client

    try:
        client = Client(address, timeout=_ANSWER_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--scheduler {address}: no Dask scheduler answers; check that it runs there") from error
    try:
        _check_workers(client, address, out)
        yield client
    finally:
        client.close(timeout=_CLOSE_S)


def _check_workers(client: Client, address: str, out: Path) -> None:
    try:
        client.wait_for_workers(1, timeout=_WORKERS_S)
    except TimeoutError as error:
        raise InputError(f"--scheduler {address}: has no workers; start some with: dask worker {address}") from error
    token = out.absolute() / HIDDEN / f"seen-{uuid4().hex}"
    write_text(token, "")
    try:
        wrong = {name: words for name, words in client.run(_probe(), str(token), __version__).items() if words}
    finally:
        token.unlink(missing_ok=True)
    if wrong:
        name, words = next(iter(wrong.items()))
        raise InputError(f"--scheduler {address}: worker {name} {words} ({len(wrong)} such workers)")


def _probe() -> Any:
    """What a worker answers; a nested function, so that it arrives where organphys is not installed."""

    def probe(token: str, version: str) -> str:
        from os.path import exists

        try:
            from organphys import __version__ as there
        except ImportError:
            return f"has no organphys; install organphys {version} there"
        if there != version:
            return f"has organphys {there}; install organphys {version} there"
        return "" if exists(token) else "does not see the folder --out; name a folder that all machines share"

    return probe
