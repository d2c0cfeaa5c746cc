"""One method, or several one after the other, on one case under one condition, in this process.

    python -m organphys_bench.runs.one_run CASE_FOLDER METHOD[,METHOD...] CONDITION OUT

The truth is read with the case, but the method is handed a Problem, which has none. Time and memory are written down of
the case as it is only, where the process does nothing else; in the sweeps methods share a process and their start.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from case_inputs import CaseInputs, read_case

from organphys.ground.checks import InputError
from organphys.pipeline.processor import one_blas_thread, peak_memory_mb

from ..figures.run_figures import picture_data, run_figures
from ..peers.methods import METHODS
from ..problem.outcome import Clock
from ..problem.problem import Problem
from .conditions import BASELINE, Condition
from .run_file import RunKey, write_run


@one_blas_thread
def one_run(inputs: CaseInputs, problem: Problem, method: str, condition: Condition) -> dict[str, Any]:
    """Register and measure; a run that the method itself refuses is a result too, with its ``failure``."""
    clock = Clock()
    begin, begin_processor = perf_counter(), process_time()
    try:
        outcome = METHODS[method].register(problem, clock)
    except InputError as error:
        return {"failure": str(error)}
    spent = {"wall_s": perf_counter() - begin, "processor_s": process_time() - begin_processor}
    cost = {"seconds": {**clock.stages, "total": spent}, "peak_memory_mb": peak_memory_mb()}
    content: dict[str, Any] = {
        "failure": "",
        "figures": run_figures(outcome, inputs.organ, problem.case.scene.target, inputs.truth, seed=condition.seed),
        "extension": outcome.extension,
        "facts": dict(outcome.facts),
    }
    if condition.sweep == BASELINE:
        content |= cost | {"picture": picture_data(outcome, inputs.organ, inputs.truth)}
    return content


def main(arguments: list[str]) -> None:
    folder, methods, condition, out = Path(arguments[0]), arguments[1], Condition.parse(arguments[2]), arguments[3]
    inputs = condition.changed(read_case(folder))
    problem = Problem.of(inputs, seed=condition.seed)
    for method in methods.split(","):
        key = RunKey(folder.name, method, condition)
        write_run(key.path(Path(out)), key, one_run(inputs, problem, method, condition))


if __name__ == "__main__":
    main(sys.argv[1:])
