"""Hostile files: a short campaign against every reader, and all that ever made one fail. The long one: make fuzz."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).resolve().parents[1] / "fuzz"
sys.path.append(str(FUZZ))

from seed_files import write_corpus  # noqa: E402
from supervised import run_jobs  # noqa: E402

INPUTS = {
    "splat": 300, "labels": 250, "landmarks": 300, "pins": 300, "region": 300, "trajectory": 300, "points": 300,
    "asset": 200, "sequence": 200, "recording": 100, "case": 200, "outcome": 200,
    "times": 200, "frames": 200, "cases": 100,
}  # fmt: skip
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="memory is measured by Linux's /proc")
SEED = 1


@LINUX
def test_hostile_files_are_read_rightly_or_refused(tmp_path: Path) -> None:
    write_corpus(tmp_path / "corpus")
    jobs = [(reader, 0, count) for reader, count in INPUTS.items()]
    tallies = run_jobs(tmp_path / "corpus", tmp_path / "run", SEED, jobs)
    assert {reader: tally.failures for reader, tally in tallies.items() if tally.failures} == {}
    assert {reader: tally.tried for reader, tally in tallies.items()} == INPUTS
    # neither all refused nor all taken: the mutations reach into the readers
    assert all(0.03 < tally.read / tally.tried < 0.9 for tally in tallies.values())


@LINUX
def test_what_was_found_stays_fixed(tmp_path: Path) -> None:
    """In a process of its own: some of these files killed it."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    command = [sys.executable, str(FUZZ / "replay.py"), str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)
    outcomes = [json.loads(line) for line in run.stdout.splitlines()]
    assert [outcome for outcome in outcomes if outcome[1] == "failed"] == []
    known = json.loads((FUZZ / "found" / "causes.json").read_text())
    assert sorted(outcome[0] for outcome in outcomes) == sorted(known) and run.returncode == 0, run.stderr[-500:]


@LINUX
def test_guided_by_coverage_inputs_of_new_branches_are_kept(tmp_path: Path) -> None:
    """The harness of make fuzz-guided; that it reaches more than the seeds do tells that the guidance works."""
    pytest.importorskip("atheris", reason="has wheels for Linux and Python 3.11 to 3.13 only")
    from guided import Guided, lines_reached, run_guided
    from kept import keep_seeds

    corpus, folder, guided = tmp_path / "corpus", tmp_path / "region", Guided()
    write_corpus(corpus)
    keep_seeds(corpus, "region", folder / "kept")
    run_guided(corpus, folder, "region", 400, guided)
    assert (guided.tried, guided.failures) == (400, {})
    lines = lines_reached(corpus, folder, "region", 1)
    assert lines["guided"] > lines["seeds"] + 10  # lines that refuse something


@LINUX
def test_the_harness_sees_a_crash_and_a_hang(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker that dies at one input and sleeps at another: both are told, all others are tried."""
    import supervised

    (tmp_path / "worker.py").write_text(
        f"""
import os, sys, time
from pathlib import Path
sys.path.insert(0, {str(FUZZ)!r})
from progress import Counts, Progress
progress = Progress(Path(sys.argv[2]) / "progress", [0])
_, first, last = sys.argv[4].split(":")
for k in range(int(first), int(last)):
    if k == 3:
        os.kill(os.getpid(), 11)
    while k == 5:
        pass
    progress.note(0, Counts(k + 1, read=k + 1 - int(first)))
"""
    )
    monkeypatch.setattr(supervised, "HERE", tmp_path)
    monkeypatch.setattr(supervised, "LONGEST_SECONDS", 0.3)
    monkeypatch.setattr(supervised, "START_SECONDS", 0.3)
    tally = run_jobs(tmp_path, tmp_path / "run", 0, [("any", 0, 8)])["any"]
    assert tally.tried == 8 and tally.read == 6
    assert tally.failures == {"killed by signal 11": [3], "hang": [5]}
