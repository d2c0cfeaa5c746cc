"""Hostile files guided by coverage: libFuzzer (atheris) against every reader; it goes on where it stopped.

    make fuzz-guided                                            10,000 inputs for each reader
    python Testing/fuzz/guided.py --inputs 5000 --readers splat,labels

How many lines of organphys its inputs reach is told beside those of as many inputs without guidance, in RESULTS.md.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "core"), str(HERE.parent / "benchmarks")]

from guided_results import write_results  # noqa: E402
from kept import keep_seeds  # noqa: E402
from seed_files import CASES, write_corpus  # noqa: E402
from targets import TARGETS  # noqa: E402

OUTPUT = HERE.parent / "output" / "fuzz"


@dataclass
class Guided:
    """Of one reader: inputs tried, failures (signature -> the first file), processor seconds, lines reached."""

    tried: int = 0
    failures: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    lines: dict[str, int | list[str]] = field(default_factory=dict)


def main(arguments: list[str] | None = None) -> int:
    """The command; 1 where a reader failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=10_000, help="for each reader, those of earlier runs counted")
    parser.add_argument("--readers", default=",".join(TARGETS), help="separated by commas")
    parser.add_argument("--out", type=Path, default=OUTPUT)
    parser.add_argument("--cases", type=Path, default=CASES, help="folder of case folders, parts of which are seeds")
    parser.add_argument("--results", type=Path, default=HERE.parent / "benchmarks" / "RESULTS.md")
    options = parser.parse_args(arguments)
    os.nice(10)
    corpus, state = options.out / "corpus", options.out / "guided.json"
    write_corpus(corpus, options.cases)
    stored = json.loads(state.read_text()) if state.exists() else {}
    found = {reader: Guided(**entry) for reader, entry in stored.items()}
    for reader in options.readers.split(","):
        guided, folder = found.setdefault(reader, Guided()), options.out / "guided" / reader
        keep_seeds(corpus, reader, folder / "kept")
        while guided.tried < options.inputs:
            run_guided(corpus, folder, reader, options.inputs - guided.tried, guided)
            guided.lines = lines_reached(corpus, folder, reader, guided.tried) if guided.tried >= options.inputs else {}
            state.write_text(json.dumps({name: asdict(one) for name, one in found.items()}, indent=1))
            print(f"{reader}: {guided.tried} tried, {guided.lines}, {guided.failures}", flush=True)
    done = {reader: one for reader, one in found.items() if one.lines}
    write_results(options.results, done, "make fuzz-guided, or Testing/fuzz/guided.py with other numbers of inputs")
    return int(any(one.failures for one in found.values()))


def run_guided(corpus: Path, folder: Path, reader: str, runs: int, guided: Guided) -> None:
    """At most ``runs`` inputs more, in a process that may die of one."""
    report, companions = folder / "failures.jsonl", {path.name for path in (corpus / "companions").iterdir()}
    report.unlink(missing_ok=True)
    began = _children_seconds()
    command = [str(HERE / "guided_worker.py"), str(corpus), str(folder), reader, str(guided.tried), str(runs)]
    with (folder / "log").open("wb") as log:
        done = subprocess.run([sys.executable, *command], stderr=log, stdout=log, env=_environment(), check=False)
    guided.seconds += _children_seconds() - began
    guided.tried += _tried(folder / "log", runs)
    for line in report.read_text().splitlines() if report.exists() else ():
        failure = json.loads(line)
        guided.failures.setdefault(failure["what"], failure.get("file", ""))
    if done.returncode > 0:
        raise RuntimeError(f"{reader}: the process ended with {done.returncode}; see {folder}/log and noise")
    if done.returncode < 0:
        what = "hang" if done.returncode == -signal.SIGPROF else f"killed by signal {-done.returncode}"
        for path in [path for path in (folder / "in").iterdir() if path.name not in companions]:
            kept = path.replace(folder / f"died_{guided.tried}_{path.name}")
            guided.failures.setdefault(what, kept.name)


def _tried(log: Path, runs: int) -> int:
    """The last number that libFuzzer told; its lines begin with it."""
    words = [line.split()[0] for line in log.read_text(errors="replace").splitlines() if line.startswith("#")]
    numbers = [int(word[1:]) for word in words if word[1:].isdigit()]
    return min(max(numbers, default=0), runs) or 1


def lines_reached(corpus: Path, folder: Path, reader: str, count: int) -> dict[str, int | list[str]]:
    """Lines that the seeds, ``count`` blind inputs and what is kept reach."""
    command = [sys.executable, str(HERE / "lines_reached.py"), str(corpus), str(folder), reader, str(count)]
    told = subprocess.run(command, check=True, capture_output=True, text=True, env=_environment())
    lines: dict[str, int | list[str]] = json.loads(told.stdout.splitlines()[-1])
    return lines


def _environment() -> dict[str, str]:
    threads = {"OMP_NUM_THREADS": "1", "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS": "1"}
    return os.environ | threads | {"PYTHONPATH": str(HERE.parent / "core")}


def _children_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    sys.exit(main())
