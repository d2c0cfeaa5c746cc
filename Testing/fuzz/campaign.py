"""The long campaign against every reader; it goes on where it stopped.

    make fuzz                                                   200,000 inputs for each reader
    python Testing/fuzz/campaign.py --inputs 5000 --readers splat,labels

What it found lies in Testing/output/fuzz; RESULTS.md gets its part.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from dataclasses import asdict
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "core"), str(HERE.parent / "benchmarks")]

from results import write_results  # noqa: E402
from seed_files import CASES, write_corpus  # noqa: E402
from supervised import Tally, run_jobs  # noqa: E402
from targets import TARGETS  # noqa: E402

OUTPUT = HERE.parent / "output" / "fuzz"
BATCH = 20_000  # a worker takes a second or two to start


def main(arguments: list[str] | None = None) -> int:
    """The command; 1 where a reader failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=200_000, help="for each reader, those of earlier runs counted")
    parser.add_argument("--readers", default=",".join(TARGETS), help="separated by commas")
    parser.add_argument("--seed", type=int, default=0, help="another one gives other inputs")
    parser.add_argument("--out", type=Path, default=OUTPUT)
    parser.add_argument("--cases", type=Path, default=CASES, help="folder of case folders, parts of which are seeds")
    parser.add_argument("--results", type=Path, default=HERE.parent / "benchmarks" / "RESULTS.md")
    parser.add_argument("--minutes", type=float, default=1e9, help="of processor time, then it stops")
    options = parser.parse_args(arguments)
    os.nice(10)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the worker is ended too
    corpus = options.out / "corpus"
    write_corpus(corpus, options.cases)
    state = load_state(options.out)
    spent = 0.0
    for reader in options.readers.split(","):
        tally = state.setdefault(f"{options.seed}:{reader}", Tally())
        if tally.failures:
            spent += _again(corpus, options, reader, tally)
            save_state(options.out, state)
        while tally.tried < options.inputs and spent < 60 * options.minutes:
            last = min(tally.tried + BATCH, options.inputs)
            spent += _batch(corpus, options, reader, last, tally)
            save_state(options.out, state)
            told = f"{len(tally.failed)} failures of {len(tally.failures)} kinds"
            print(f"{reader}: {tally.tried} tried, {tally.read} read, {tally.refused} refused, {told}", flush=True)
    write_results(options.results, state, "make fuzz, or Testing/fuzz/campaign.py with other numbers of inputs")
    return int(any(tally.failures for tally in state.values()))


def _batch(corpus: Path, options: argparse.Namespace, reader: str, last: int, tally: Tally) -> float:
    new = run_jobs(corpus, options.out / reader, options.seed, [(reader, tally.tried, last)])[reader]
    tally.add(new)
    return new.seconds


def _again(corpus: Path, options: argparse.Namespace, reader: str, tally: Tally) -> float:
    """What failed is tried again first: the reader may have been mended."""
    jobs = [(reader, index, index + 1) for index in tally.failed]
    new = run_jobs(corpus, options.out / reader, options.seed, jobs)[reader]
    tally.tried -= len(jobs)
    tally.failures.clear()
    tally.files.clear()
    tally.add(new)
    return new.seconds


def load_state(folder: Path) -> dict[str, Tally]:
    """The tallies of earlier runs, by "seed:reader"."""
    path = folder / "state.json"
    entries = json.loads(path.read_text()) if path.exists() else {}
    return {name: Tally(**entry) for name, entry in entries.items()}


def save_state(folder: Path, state: dict[str, Tally]) -> None:
    temporary = folder / "state.part"
    temporary.write_text(json.dumps({name: asdict(tally) for name, tally in state.items()}, indent=1))
    temporary.replace(folder / "state.json")


if __name__ == "__main__":
    sys.exit(main())
