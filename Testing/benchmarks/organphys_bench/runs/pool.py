"""Runs as child processes, some at a time: each has its own peak memory, and one that dies takes nothing with it."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from .. import SCRIPTS
from .run_file import RunKey, write_run

TIMEOUT_S = 1800


def run_all(
    keys: Sequence[RunKey],
    folders: dict[str, Path],
    out: Path,
    *,
    jobs: int,
    tell: Callable[[str], None],
    minutes: float | None = None,
) -> None:
    """Run what has no file under ``out`` yet; ``folders``: of the cases by name. Ctrl-C leaves the finished ones.

    After ``minutes`` no run is begun; those under way are waited for.
    """
    end = time.monotonic() + 60 * (math.inf if minutes is None else minutes)
    missing = [key for key in keys if not key.is_done(out)]
    if len(missing) < len(keys):
        there = sorted({key.commit(out) for key in keys if key.is_done(out)})
        tell(f"{len(keys) - len(missing)} of {len(keys)} runs are there already, of commit {', '.join(there)}")
    with ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(_run_in_time, end, key, folders[key.case], key.path(out)): key for key in missing}
        count = 0
        try:
            for done in as_completed(waiting):
                key, word = waiting[done], done.result()
                if word is not None:
                    count += 1
                    tell(f"[{count}/{len(missing)}] {key.case}, {key.method}, {key.condition.text}: {word}")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    if count < len(missing):
        tell(f"{len(missing) - count} runs are left for another time: {minutes:g} minutes are over")


def _run_in_time(end: float, key: RunKey, folder: Path, path: Path) -> str | None:
    """``run_one``, or None where it would begin after ``end``, s."""
    return None if time.monotonic() > end else run_one(key, folder, path)


def run_one(key: RunKey, folder: Path, path: Path, *, timeout_s: float = TIMEOUT_S) -> str:
    """One run; a word on how it ended. A process that fails is written down as a failure with its last line."""
    command = [sys.executable, "-m", "organphys_bench.runs.one_run", str(folder), key.method, key.condition.text]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": _search_path()}
    try:
        done = subprocess.run([*command, str(path)], env=environment, capture_output=True, text=True, timeout=timeout_s)
    except subprocess.TimeoutExpired:
        write_run(path, key, {"failure": f"no result within {timeout_s:g} s"})
        return "out of time"
    if done.returncode < 0:  # killed, by Ctrl-C too: not the method's doing, so it is run again next time
        return f"killed by signal {-done.returncode}, not written down"
    if done.returncode:
        line = (done.stderr.strip().splitlines() or ["no message"])[-1]
        write_run(path, key, {"failure": line})
    return ending(path)


def ending(path: Path) -> str:
    """How a run that was written down ended."""
    failure = json.loads(path.read_text(encoding="utf-8"))["failure"]
    return f"failed, {failure}" if failure else "done"


def _search_path() -> str:
    """The folder of this package and its neighbours before whatever the path holds."""
    before = os.environ.get("PYTHONPATH")
    return str(SCRIPTS) if not before else f"{SCRIPTS}{os.pathsep}{before}"
