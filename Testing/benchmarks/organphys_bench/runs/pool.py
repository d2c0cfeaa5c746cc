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
from .conditions import BASELINE
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

    After ``minutes`` no process is begun; those under way are waited for.
    """
    end = time.monotonic() + 60 * (math.inf if minutes is None else minutes)
    missing = [key for key in keys if not key.is_done(out)]
    if len(missing) < len(keys):
        there = sorted({key.commit(out) for key in keys if key.is_done(out)})
        tell(f"{len(keys) - len(missing)} of {len(keys)} runs are there already, of commit {', '.join(there)}")
    with ThreadPoolExecutor(jobs) as pool:
        waiting = [pool.submit(_run_in_time, end, group, folders[group[0].case], out) for group in groups(missing)]
        count = 0
        try:
            for done in as_completed(waiting):
                for key, word in done.result().items():
                    count += 1
                    tell(f"[{count}/{len(missing)}] {key.case}, {key.method}, {key.condition.text}: {word}")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    if count < len(missing):
        tell(f"{len(missing) - count} runs are left for another time: {minutes:g} minutes are over")


def groups(keys: Sequence[RunKey]) -> list[list[RunKey]]:
    """What shares a process: runs of the baseline none, as they are timed; in the sweeps neighbours of one case and
    condition, which share its inputs and start."""
    made: list[list[RunKey]] = []
    for key in keys:
        last = made[-1][0] if made else None
        if last and key.condition.sweep != BASELINE and (key.case, key.condition) == (last.case, last.condition):
            made[-1].append(key)
        else:
            made.append([key])
    return made


def _run_in_time(end: float, group: Sequence[RunKey], folder: Path, out: Path) -> dict[RunKey, str]:
    """``run_group``, or nothing where it would begin after ``end``, s."""
    return {} if time.monotonic() > end else run_group(group, folder, out)


def run_group(group: Sequence[RunKey], folder: Path, out: Path, *, timeout_s: float = TIMEOUT_S) -> dict[RunKey, str]:
    """Runs of one case and condition in a process; a word on how each ended. Where the process fails, the method that
    it was at gets a failure with its last line, and the rest another process."""
    words, left = {}, list(group)
    while left:
        word = _run_process(left, folder, out, timeout_s)
        stopped = next((key for key in left if not key.is_done(out)), None)
        if stopped and not word:  # killed, by Ctrl-C too: not the method's doing, so it is run again next time
            return words | {key: "killed, not written down" for key in left if not key.is_done(out)}
        if stopped:
            write_run(stopped.path(out), stopped, {"failure": word})
        words |= {key: ending(key.path(out)) for key in left if key.is_done(out)}
        left = [key for key in left if key not in words]
    return words


def _run_process(group: Sequence[RunKey], folder: Path, out: Path, timeout_s: float) -> str:
    """Run a process for ``group``; why it stopped, empty where it was killed."""
    methods = ",".join(key.method for key in group)
    command = [sys.executable, "-m", "organphys_bench.runs.one_run", str(folder), methods, group[0].condition.text]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": _search_path()}
    limit_s = timeout_s * len(group)
    try:
        done = subprocess.run([*command, str(out)], env=environment, capture_output=True, text=True, timeout=limit_s)
    except subprocess.TimeoutExpired:
        return f"no result within {limit_s:g} s"
    return "" if done.returncode < 0 else (done.stderr.strip().splitlines() or ["no message"])[-1]


def ending(path: Path) -> str:
    """How a run that was written down ended."""
    failure = json.loads(path.read_text(encoding="utf-8"))["failure"]
    return f"failed, {failure}" if failure else "done"


def _search_path() -> str:
    """The folder of this package and its neighbours before whatever the path holds."""
    before = os.environ.get("PYTHONPATH")
    return str(SCRIPTS) if not before else f"{SCRIPTS}{os.pathsep}{before}"
