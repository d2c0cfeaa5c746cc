"""The parts of OrganPhys for pytest-benchmark, by processor time (CUDA: by the clock).

    OMP_NUM_THREADS=1 python -m pytest Testing/benchmarks/parts_benchmark.py [--benchmark-autosave]

parts_speed.py runs the same and keeps a history in the repository.
"""

from __future__ import annotations

import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from parts_of_organphys import Parts, made_parts

from organphys.pipeline.processor import one_blas_thread

LEAST_RUNS, LEAST_S, MOST_RUNS, SLOW_S = 4, 0.5, 200, 1.0
FOLDER = tempfile.TemporaryDirectory(prefix="organphys-parts-")  # goes with the process


@cache
def parts() -> Parts:
    """Made when the benchmarks are collected: their names are needed then."""
    return made_parts(Path(FOLDER.name))


def pytest_generate_tests(metafunc: Any) -> None:
    found = parts()
    marked = [
        pytest.param(name, marks=pytest.mark.benchmark(timer=clock))
        for name in found.timed
        for clock in [time.perf_counter if name in found.by_clock else time.process_time]
    ]
    missing = [pytest.param(name, marks=pytest.mark.skip(reason=why)) for name, why in found.missing.items()]
    metafunc.parametrize("name", [*marked, *missing])


@one_blas_thread
def test_part(benchmark: Any, name: str) -> None:
    """At least four runs of a part of less than a second, one of a slower one, after one that is not counted, in which
    what is made once is made."""
    part = parts().timed[name]
    start = time.process_time()
    part()
    spent = time.process_time() - start
    rounds = 1 if spent > SLOW_S else max(LEAST_RUNS, min(MOST_RUNS, round(LEAST_S / max(spent, 1e-6))))
    benchmark.extra_info["remarks"] = parts().remarks
    benchmark.pedantic(part, rounds=rounds)
