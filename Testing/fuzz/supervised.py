"""A worker under watch: started, timed, restarted after a crash or a hang; no input is tried twice or left out."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from progress import Progress

HERE = Path(__file__).resolve().parent
LONGEST_SECONDS = 5.0  # of processor time for one input
START_SECONDS = 60.0  # for loading the libraries and reading the seeds
LONGEST_WAIT = 300.0  # of the clock, for an input that sleeps
Job = tuple[str, int, int]


@dataclass
class Tally:
    """What became of the inputs of one reader; failures: signature -> the inputs' numbers; files: the first of each."""

    tried: int = 0
    read: int = 0
    refused: int = 0
    seconds: float = 0.0
    failures: dict[str, list[int]] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)

    @property
    def failed(self) -> list[int]:
        """The numbers of all inputs that failed."""
        return sorted(index for indices in self.failures.values() for index in indices)

    def add(self, other: Tally) -> None:
        """Count the inputs of another run as well."""
        self.tried += other.tried
        self.read += other.read
        self.refused += other.refused
        self.seconds += other.seconds
        for what, indices in other.failures.items():
            self.failures[what] = self.failures.get(what, []) + indices
        self.files = other.files | self.files

    def fail(self, what: str, index: int, file: str | None = None) -> None:
        self.failures.setdefault(what, []).append(index)
        if file is not None:
            self.files.setdefault(what, file)


def run_jobs(corpus: Path, folder: Path, seed: int, jobs: list[Job]) -> dict[str, Tally]:
    """Every input of the jobs (reader, first, last) tried once; failing ones lie in ``folder``, one of each kind."""
    folder.mkdir(parents=True, exist_ok=True)
    tallies = {reader: Tally() for reader, _, _ in jobs}
    while jobs:
        (folder / "failures.jsonl").unlink(missing_ok=True)
        progress = Progress(folder / "progress", [first for _, first, _ in jobs], new=True)
        lethal = _watched(corpus, folder, seed, jobs, progress)
        _add(tallies, jobs, progress, folder)
        if not lethal:
            break
        job = progress.job
        reader, last, at = jobs[job][0], jobs[job][2], progress.counts(job).index
        tallies[reader].fail(lethal, at)
        tallies[reader].tried += 1
        jobs = [(reader, at + 1, last), *jobs[job + 1 :]]
    return tallies


def _watched(corpus: Path, folder: Path, seed: int, jobs: list[Job], progress: Progress) -> str:
    """What ended the worker before its time, if anything did."""
    command = [sys.executable, str(HERE / "worker.py"), str(corpus), str(folder), str(seed)]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS": "1"}
    process = subprocess.Popen([*command, *(":".join(map(str, job)) for job in jobs)], env=environment)
    try:
        if not _ends_in_time(process, jobs, progress):
            return "hang"
    finally:
        process.kill()  # no worker outlives its parent
        process.wait()
    if process.returncode > 0:
        raise RuntimeError(f"the worker ended with {process.returncode}; the end of {folder}/noise says why")
    return f"killed by signal {-process.returncode}" if process.returncode else ""


def _ends_in_time(process: subprocess.Popen[bytes], jobs: list[Job], progress: Progress) -> bool:
    """Waits for the worker; False at an input that takes too long."""
    at, since, began = (-1, -1), 0.0, time.monotonic()
    while process.poll() is None:
        time.sleep(0.05)
        job, used = progress.job, _processor_seconds(process.pid)
        now = (job, progress.counts(job).index if job < len(jobs) else 0)
        allowed = START_SECONDS if at == (-1, -1) or now == (0, jobs[0][1]) else LONGEST_SECONDS
        if now != at:
            at, since, began = now, used, time.monotonic()
        elif used - since > allowed or time.monotonic() - began > LONGEST_WAIT:
            return False
    return True


def _add(tallies: dict[str, Tally], jobs: list[Job], progress: Progress, folder: Path) -> None:
    for k, (reader, first, _) in enumerate(jobs):
        counts, tally = progress.counts(k), tallies[reader]
        tally.tried += counts.index - first
        tally.read += counts.read
        tally.refused += counts.refused
        tally.seconds += counts.seconds
    report = folder / "failures.jsonl"
    for line in report.read_text().splitlines() if report.exists() else ():
        failure = json.loads(line)
        tallies[failure["reader"]].fail(failure["what"], failure["index"], failure.get("file"))


def _processor_seconds(pid: int) -> float:
    """Processor time of a process so far (Linux; elsewhere the clock)."""
    stat = Path(f"/proc/{pid}/stat")
    if not stat.parent.parent.joinpath("self").exists():
        return time.monotonic()
    try:
        fields = stat.read_text().rpartition(")")[2].split()
    except OSError:  # it has just ended
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
