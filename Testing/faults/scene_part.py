"""The Slicer modules' share of the campaign: Testing/slicer/test_scene_faults.py with more trials, and 100 runs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1] / "slicer" / "test_scene_faults.py"
BLOCK, RUNS = 60, 100  # trials of one process; whole runs for the growth of memory


def run_scene_trials(trials: int, state: dict, save: Callable[[dict], None]) -> None:
    """Those trials that have not been yet; nothing where the host cannot run."""
    first = len(state["scenes"])
    while first < trials:
        last = min(first + BLOCK, trials)
        records = _pytest("nothing_is_left", "trials.jsonl", ORGANPHYS_SCENE_TRIALS=f"{first}:{last}")
        for record in records:
            state["scenes"][str(record["number"])] = record
        save(state)
        if not records:
            print("the Slicer modules cannot be tested here", flush=True)
            return
        first = last
    if trials and len(state["growth"].get("memory_mb", [])) < RUNS:
        found = _pytest("memory", "memory.jsonl", ORGANPHYS_SCENE_RUNS=str(RUNS))
        state["growth"] = {"memory_mb": found[0] if found else []}
        save(state)


def _pytest(which: str, file: str, **variables: str) -> list:
    """The records that the test wrote; what failed is in them too."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | variables | {"ORGANPHYS_SCENE_RESULTS": folder}
        command = [sys.executable, "-m", "pytest", "-q", str(TESTS), "-k", which]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        path = Path(folder) / file
        if done.returncode:
            print(done.stdout[-1500:], flush=True)
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
