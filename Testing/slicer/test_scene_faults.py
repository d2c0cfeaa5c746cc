"""Runs and simulations that are cancelled, or lose a node or the scene, at random moments leave nothing behind.

More of them, and 100 runs for memory: Testing/faults/campaign.py, which sets the variables below.
"""

from __future__ import annotations

import ctypes
import json
import os
from pathlib import Path

import numpy as np
import pytest
import scene_faults as faults

from OrganPhysSimulationLib.logic import OrganPhysSimulationLogic

FIRST, LAST = (int(text) for text in os.environ.get("ORGANPHYS_SCENE_TRIALS", "0:12").split(":"))
RUNS = int(os.environ.get("ORGANPHYS_SCENE_RUNS", "12"))
RESULTS = os.environ.get("ORGANPHYS_SCENE_RESULTS")  # a folder
WARM, MB_PER_RUN = 0.4, 0.03  # share of the runs until caches are full; allowed growth, MB a run
SLOW = ("", "elastic=slow", "grids=slow")
EVERY = 6  # one of so many trials is a simulation


@pytest.fixture(scope="module")
def outcomes(host: object, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return faults.write_outcomes(tmp_path_factory.mktemp("outcomes"))


def note(name: str, record: object) -> None:
    if RESULTS:
        with (Path(RESULTS) / name).open("a") as file:
            file.write(json.dumps(record) + "\n")


def test_nothing_is_left_over_whenever_it_ends(host, scene, scene_contents, outcomes, simulation_files) -> None:
    logics, simulation = {at: faults.fake_logic(outcomes, at) for at in SLOW}, OrganPhysSimulationLogic()
    failures, observed = [], []
    before = [faults.alive(kind) for kind in faults.HELD]  # of other tests in this process
    for number in range(FIRST, LAST):
        rng = np.random.default_rng([7, number])
        if number % EVERY == EVERY - 1:
            trial = faults.simulation_trial(host, simulation, simulation_files, scene_contents, rng)
        else:
            logic = logics[SLOW[number % len(SLOW)]]
            trial = faults.registration_trial(host, logic, scene_contents, rng)
        observed.append(faults.observers())
        held = [faults.alive(kind) - count for kind, count in zip(faults.HELD, before, strict=True)]
        note("trials.jsonl", {"number": number, **vars(trial), "observers": observed[-1], "held": held})
        failures += [trial.failure] if trial.failure else []
        assert held[0] <= 2 * len(SLOW) and held[1] <= 0, held  # the last of each logic, and one its child may hold
    for each in logics.values():
        each.cleanup()
    simulation.cleanup()
    assert failures == []
    assert observed[-1] <= max(observed[: 2 * EVERY]), observed  # all kinds have been there by then


def test_memory_does_not_grow_from_run_to_run(host, scene, outcomes) -> None:
    logic = faults.fake_logic(outcomes, "")
    if not hasattr(ctypes.CDLL(None), "mallinfo2"):
        pytest.skip("what is allocated is told by glibc from 2.33")
    memory = list(faults.whole_runs(host, logic, RUNS))
    note("memory.jsonl", memory)
    logic.cleanup()
    late = [allocated for _, allocated in memory[int(WARM * RUNS) :]]
    growth = (late[-1] - late[0]) / (len(late) - 1)
    assert growth < MB_PER_RUN, f"{growth:.3f} MB a run: {np.round(memory, 2).tolist()}"
