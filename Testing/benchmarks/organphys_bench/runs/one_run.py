"""One method on one case under one condition, in this process, which does nothing else.

    python -m organphys_bench.runs.one_run CASE_FOLDER METHOD CONDITION FILE

The truth is read with the case, but the method is handed a Problem, which has none.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from case_inputs import read_case

from organphys.ground.checks import InputError
from organphys.pipeline.processor import one_blas_thread, peak_memory_mb

from ..figures.run_figures import picture_data, run_figures
from ..peers.methods import METHODS
from ..problem.outcome import Clock
from ..problem.problem import Problem
from .conditions import BASELINE, Condition
from .run_file import RunKey, write_run


@one_blas_thread
def one_run(folder: Path, method: str, condition: Condition) -> dict[str, Any]:
    """Register and measure; a run that the method itself refuses is a result too, with its ``failure``."""
    inputs = condition.changed(read_case(folder))
    problem, clock = Problem.of(inputs, seed=condition.seed), Clock()
    begin, begin_processor = perf_counter(), process_time()
    try:
        outcome = METHODS[method].register(problem, clock)
    except InputError as error:
        return {"failure": str(error)}
    spent = {"wall_s": perf_counter() - begin, "processor_s": process_time() - begin_processor}
    content: dict[str, Any] = {
        "failure": "",
        "seconds": {**clock.stages, "total": spent},
        "peak_memory_mb": peak_memory_mb(),
        "figures": run_figures(outcome, inputs.organ, problem.case.scene.target, inputs.truth, seed=condition.seed),
        "extension": outcome.extension,
        "facts": dict(outcome.facts),
    }
    if condition.sweep == BASELINE:
        content["picture"] = picture_data(outcome, inputs.organ, inputs.truth)
    return content


def main(arguments: list[str]) -> None:
    folder, method, condition, path = Path(arguments[0]), arguments[1], Condition.parse(arguments[2]), arguments[3]
    write_run(Path(path), RunKey(folder.name, method, condition), one_run(folder, method, condition))


if __name__ == "__main__":
    main(sys.argv[1:])
