"""The process that reads hostile files guided by coverage: libFuzzer (atheris) keeps each input that takes a new branch
of organphys and mutates it further, with this harness's own mutations of each format and with its own of bytes.

    python guided_worker.py CORPUS FOLDER READER FIRST RUNS

FOLDER/kept holds what it keeps, for the next run too; failures are told as those of worker.py; where an input ends the
process, it still lies in FOLDER/in.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from pathlib import Path

import atheris
import numpy as np

with atheris.instrument_imports(include=["organphys"]):
    from corpus import read_corpus
    from kept import packed, unpacked
    from mutate import BY_ENDING
    from mutate_bytes import mutate_bytes
    from supervised import LONGEST_SECONDS
    from worker import Worker, confined, made_ready, overheard, warmed_up

LIBFUZZER_BYTES = 0.3  # share of mutations that are libFuzzer's own


class Guided:
    """What libFuzzer calls: the inputs of one reader, numbered from ``first`` on."""

    def __init__(self, worker: Worker, reader: str, first: int) -> None:
        self.worker, self.reader, self.index = worker, reader, first
        self.names = sorted(read_corpus(worker.corpus, reader))
        self.begun = False

    def one_input(self, data: bytes) -> None:
        if not self.begun:  # by now libFuzzer has put its own words on another descriptor
            self.begun = True
            overheard(self.worker.folder)
            confined()
            signal.signal(signal.SIGALRM, signal.SIG_IGN)  # libFuzzer's clock, whose handler is not in place
        name, content = unpacked(data, self.names)
        signal.setitimer(signal.ITIMER_PROF, LONGEST_SECONDS)  # of processor time, then the process is ended
        outcome = self.worker.tried(self.reader, name, content)
        signal.setitimer(signal.ITIMER_PROF, 0)
        if outcome.kind == "failed":
            self.worker.report(self.reader, self.index, name, content, outcome)
        self.index += 1

    def mutated(self, data: bytes, most: int, seed: int) -> bytes:
        """At most ``most`` bytes; one in thirty under another seed's name."""
        rng = np.random.default_rng(seed)
        name, content = unpacked(data, self.names)
        if rng.random() < LIBFUZZER_BYTES:
            content = atheris.Mutate(content, most - 1)
        else:
            content = self._by_ending(name, content, rng)
        if rng.random() < 1 / 30:
            name = self.names[int(rng.integers(len(self.names)))]
        return packed(name, content, self.names)[:most]

    @staticmethod
    def _by_ending(name: str, content: bytes, rng: np.random.Generator) -> bytes:
        try:
            return BY_ENDING[next(ending for ending in BY_ENDING if name.endswith(ending))](content, rng)
        except Exception:  # what is kept may be too broken to be taken apart
            return mutate_bytes(content, rng)


def main(arguments: list[str]) -> None:
    corpus, folder, reader, first, runs = Path(arguments[0]), Path(arguments[1]), *arguments[2:5]
    worker = Worker(corpus, folder, 0)
    made_ready(corpus, folder)
    aside = os.dup(2)
    overheard(folder)
    with atheris.instrument_imports(include=["organphys"]):  # of what is imported at the first call
        warmed_up(worker, {reader})
    os.dup2(aside, 2)
    guided = Guided(worker, reader, int(first))
    longest = max(len(content) for content in read_corpus(corpus, reader).values())
    flags = [f"-runs={runs}", f"-seed={int(first) + 1}", f"-max_len={2 * longest + 4096}", "-len_control=0"]
    flags += ["-timeout=0", "-rss_limit_mb=0", "-close_fd_mask=2", "-handle_segv=0", "-handle_abrt=0", "-handle_fpe=0"]
    os.chdir(folder)
    atheris.Setup([sys.argv[0], *flags, str(folder / "kept")], guided.one_input, custom_mutator=guided.mutated)
    try:
        atheris.Fuzz()
    except Exception:
        traceback.print_exc()  # into FOLDER/noise
        os._exit(1)  # Python's own end would wait for a lock that libFuzzer holds


if __name__ == "__main__":
    main(sys.argv[1:])
