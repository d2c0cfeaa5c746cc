"""Speed of the single parts, beside the last measurement on the same machine.

    OMP_NUM_THREADS=1 nice -n 10 python Testing/benchmarks/parts_speed.py [NAME ...] [--keep]

NAME: measures only the parts whose name holds one of these. Parts of less than a second are run at least four times;
the figure is the least processor time, which other work on the machine disturbs least (CUDA: the least time by the
clock). --keep adds a line to parts_speed.jsonl, with which later runs are compared, and writes RESULTS.md.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from parts_of_organphys import Parts, made_parts
from results_file import machine_lines, write_part
from results_table import _commit, _processor

from organphys.pipeline.processor import one_blas_thread

HERE = Path(__file__).parent
HISTORY = HERE / "parts_speed.jsonl"
LEAST_RUNS, LEAST_S, MOST_RUNS, SLOW_S = 4, 0.5, 200, 1.0
CLEAR = 0.25  # smaller changes may be chance on a busy machine


@one_blas_thread
def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args()
    before, seconds = last_of_machine(), {}
    with tempfile.TemporaryDirectory() as folder:
        parts = made_parts(Path(folder))
        then = "no entry of this machine" if before is None else f"before: {before['date']}, load {before['load']:.1f}"
        print(f"{then}; load now {os.getloadavg()[0]:.1f} (on a busy machine a half more or less may be chance)")
        print(f"{'part':58s}{'ms':>10s}{'before':>10s}")
        for name, part in parts.timed.items():
            if not options.names or any(word in name for word in options.names):
                seconds[name] = least_seconds(part, by_clock=name in parts.by_clock)
                print(told(name, seconds[name], before), flush=True)
    print("\n".join(parts.remarks))
    if options.keep:
        keep({**(before or {}).get("seconds", {}), **seconds} if options.names else seconds, parts)


def least_seconds(part: Callable[[], object], *, by_clock: bool) -> float:
    """Least time of a few runs, s, a slow part's of one; the first of a quick part makes what is made once."""
    clock = time.perf_counter if by_clock else time.process_time
    times: list[float] = []
    while len(times) < LEAST_RUNS or (sum(times) < LEAST_S and len(times) < MOST_RUNS):
        if times and times[0] > SLOW_S:
            break
        start = clock()
        part()
        times.append(clock() - start)
    return min(times)


def last_of_machine() -> dict | None:
    """The last entry of this machine and number of threads in the history."""
    lines = HISTORY.read_text(encoding="utf-8").splitlines() if HISTORY.exists() else []
    entries = [entry for entry in map(json.loads, lines) if entry["machine"] == machine()]
    return entries[-1] if entries else None


def machine() -> str:
    """Processor, cores and threads of BLAS."""
    return f"{_processor()}, {os.cpu_count()} cores, OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS', 'not set')}"


def told(name: str, seconds: float, before: dict | None) -> str:
    """A line: ms now and then, and by how much it changed if that is clear."""
    then = (before or {}).get("seconds", {}).get(name)
    if then is None:
        return f"{name:58s}{1e3 * seconds:10.2f}{'-':>10s}"
    change = seconds / then - 1
    word = "" if abs(change) < CLEAR else f"  {'slower' if change > 0 else 'quicker'}: {change:+.0%}"
    return f"{name:58s}{1e3 * seconds:10.2f}{1e3 * then:10.2f}{word}"


def keep(seconds: dict[str, float], parts: Parts) -> None:
    """The history's next line and the part of RESULTS.md."""
    rounded = {name: float(f"{value:.4g}") for name, value in seconds.items()}
    date = datetime.date.today().isoformat()
    entry = {"date": date, "commit": _commit(), "machine": machine(), "load": os.getloadavg()[0], "seconds": rounded}
    with HISTORY.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")
    rows = [f"| {name} | {1e3 * value:.2f} |" for name, value in seconds.items()]
    lines = [
        "# Speed of the parts",
        "",
        "Least processor time of at least four runs, of one where it takes over a second (CUDA: by the clock).",
    ]
    lines += ["", *machine_lines("OMP_NUM_THREADS=1 nice -n 10 python Testing/benchmarks/parts_speed.py --keep")]
    lines += [f"- {remark}" for remark in parts.remarks]
    write_part(HERE / "RESULTS.md", "\n".join([*lines, "", "| part | ms |", "|---|---|", *rows]))


if __name__ == "__main__":
    main()
