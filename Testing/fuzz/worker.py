"""The process that reads hostile files: it tries inputs one after the other and may die of any of them.

    python worker.py CORPUS FOLDER SEED READER:FIRST:LAST ...

After each input it notes in FOLDER/progress, for its parent, which one is next and the counts so far; every failure is
a line of JSON in FOLDER/failures.jsonl, and the first of each kind lies beside it.
"""

from __future__ import annotations

import json
import mmap
import os
import resource
import sys
import time
import warnings
import zlib
from pathlib import Path

from corpus import read_corpus
from mutate import mutated, seed_of_input
from progress import Progress
from reader_trial import Outcome, tried
from targets import MEGABYTE, TARGETS

SPARE_BYTES = 1500 * MEGABYTE  # an allocation beyond fails instead of filling the machine
SHRINKING_TRIALS = 150


class Worker:
    """Tries the inputs of one job after the other."""

    def __init__(self, corpus: Path, folder: Path, seed: int) -> None:
        self.corpus, self.folder, self.seed = corpus, folder, seed
        self.known: set[str] = set()

    def run(self, progress: Progress, job: int, reader: str, last: int) -> None:
        files, counts, began = read_corpus(self.corpus, reader), progress.counts(job), time.process_time()
        progress.job = job
        while counts.index < last:
            name, content = mutated(files, seed_of_input(reader, self.seed, counts.index))
            outcome = self.tried(reader, name, content)
            setattr(counts, outcome.kind, getattr(counts, outcome.kind) + 1)
            if outcome.kind == "failed":
                self.report(reader, counts.index, name, content, outcome)
            counts.index, counts.seconds = counts.index + 1, time.process_time() - began
            progress.note(job, counts)

    def tried(self, reader: str, name: str, content: bytes) -> Outcome:
        path = self.folder / "in" / name
        path.write_bytes(content)
        outcome = tried(TARGETS[reader], path, content)
        path.unlink()
        noise = os.fstat(2).st_size
        if noise:
            text = (self.folder / "noise").read_text(errors="replace")
            os.ftruncate(2, 0)
            os.lseek(2, 0, os.SEEK_SET)
            if outcome.kind != "failed":
                return Outcome("failed", f"noise on stderr: {text.strip()[-40:]}", text[:2000])
        return outcome

    def report(self, reader: str, index: int, name: str, content: bytes, outcome: Outcome) -> None:
        """The failure as a line; of a new kind also the input, as small as it gets."""
        kind = f"{reader}: {outcome.what}"
        line = {"reader": reader, "index": index, "name": name, "what": outcome.what, "detail": outcome.detail}
        if kind not in self.known:
            self.known.add(kind)
            number = zlib.crc32(kind.encode(errors="replace"))
            line["file"] = f"{reader}_{number:08x}_{name}"
            (self.folder / line["file"]).write_bytes(self.shrunk(reader, name, content, outcome.what))
        with (self.folder / "failures.jsonl").open("a") as file:
            file.write(json.dumps(line) + "\n")

    def shrunk(self, reader: str, name: str, content: bytes, what: str) -> bytes:
        """The content without the parts that the failure does not need."""
        if what == "memory" or len(content) > 200_000:
            return content
        step, trials = len(content) // 2, 0
        while step >= 1 and trials < SHRINKING_TRIALS:
            at = 0
            while at < len(content) and trials < SHRINKING_TRIALS:
                shorter = content[:at] + content[at + step :]
                trials += 1
                if self.tried(reader, name, shorter).what == what:
                    content = shorter
                else:
                    at += step
            step //= 2
        return content


def made_ready(corpus: Path, folder: Path) -> None:
    """The folder that inputs are read from, with the files that some of them name."""
    (folder / "in").mkdir(exist_ok=True)
    for path in (corpus / "companions").iterdir():
        (folder / "in" / path.name).write_bytes(path.read_bytes())


def overheard(folder: Path) -> None:
    """What libraries print goes to a file, which has to stay empty."""
    noise = os.open(folder / "noise", os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
    os.dup2(noise, 2)


def confined() -> None:
    """Warnings are errors, memory is bounded, no core is dumped."""
    warnings.simplefilter("error")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    statm = Path("/proc/self/statm")
    if statm.exists():
        size = int(statm.read_text().split()[0]) * mmap.PAGESIZE
        resource.setrlimit(resource.RLIMIT_AS, (size + SPARE_BYTES, size + SPARE_BYTES))


def warmed_up(worker: Worker, readers: set[str]) -> None:
    """Every seed has to be read; libraries load, take memory and say what they say at the first call, which is free."""
    for reader in sorted(readers):
        for name, content in read_corpus(worker.corpus, reader).items():
            worker.tried(reader, name, content)
            outcome = worker.tried(reader, name, content)
            if outcome.kind != "read":
                raise SystemExit(f"{reader}: the seed {name} is not read: {outcome}")


def main(arguments: list[str]) -> None:
    corpus, folder, seed = Path(arguments[0]), Path(arguments[1]), int(arguments[2])
    jobs = [(reader, int(first), int(last)) for reader, first, last in (job.split(":") for job in arguments[3:])]
    worker, progress = Worker(corpus, folder, seed), Progress(folder / "progress", [first for _, first, _ in jobs])
    made_ready(corpus, folder)
    overheard(folder)
    warmed_up(worker, {reader for reader, _, _ in jobs})
    confined()
    for job, (reader, _, last) in enumerate(jobs):
        worker.run(progress, job, reader, last)


if __name__ == "__main__":
    main(sys.argv[1:])
