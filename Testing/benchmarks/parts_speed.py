"""Speed of the single parts by pytest-benchmark, beside the last measurement on the same machine.

    OMP_NUM_THREADS=1 nice -n 10 python Testing/benchmarks/parts_speed.py [NAME ...] [--keep]

NAME: measures only the parts whose name holds one of these. The figure is the least processor time of the runs that
parts_benchmark.py makes, which other work on the machine disturbs least (CUDA: the least time by the clock). --keep
adds a line to parts_speed.jsonl, with which later runs are compared, and writes RESULTS.md.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import sys
import tempfile
from pathlib import Path

import pytest
from results_file import machine_lines, write_part
from results_table import _commit, _processor

HERE = Path(__file__).parent
HISTORY = HERE / "parts_speed.jsonl"
CLEAR = 0.25  # smaller changes may be chance on a busy machine


class Chosen:
    """Plugin of pytest: only parts whose name holds one of ``words``, and why others are skipped."""

    def __init__(self, words: list[str]) -> None:
        self.words, self.skipped = words, list[str]()

    def pytest_collection_modifyitems(self, items: list) -> None:
        items[:] = [item for item in items if not self.words or any(w in item.callspec.id for w in self.words)]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.skipped:
            self.skipped.append(f"{report.nodeid.split('[')[-1][:-1]}: {report.longrepr[-1]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--keep", action="store_true")
    options = parser.parse_args()
    seconds, remarks = measured(options.names)
    before = last_of_machine()
    then = "no entry of this machine" if before is None else f"before: {before['date']}, load {before['load']:.1f}"
    print(f"{then}; load now {os.getloadavg()[0]:.1f} (on a busy machine a half more or less may be chance)")
    print(f"{'part':58s}{'ms':>10s}{'before':>10s}")
    print("\n".join([*(told(name, value, before) for name, value in seconds.items()), *remarks]))
    if options.keep:
        keep({**(before or {}).get("seconds", {}), **seconds} if options.names else seconds, remarks)


def measured(names: list[str]) -> tuple[dict[str, float], list[str]]:
    """Least seconds of each part by name, and remarks."""
    chosen = Chosen(names)
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "benchmark.json"
        status = pytest.main([str(HERE / "parts_benchmark.py"), "-q", f"--benchmark-json={found}"], [chosen])
        if status:
            sys.exit(f"pytest ended with status {int(status)}")
        benchmarks = json.loads(found.read_text(encoding="utf-8"))["benchmarks"]
    seconds = {one["params"]["name"]: float(one["stats"]["min"]) for one in benchmarks}
    remarks = benchmarks[0]["extra_info"]["remarks"] if benchmarks else []
    return seconds, [*remarks, *(f"skipped: {line}" for line in chosen.skipped)]


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


def keep(seconds: dict[str, float], remarks: list[str]) -> None:
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
        "By pytest-benchmark (`parts_benchmark.py`): least processor time of at least four runs, of one where it takes "
        "over a second (CUDA: by the clock). Earlier measurements: `parts_speed.jsonl`.",
    ]
    lines += ["", *machine_lines("OMP_NUM_THREADS=1 nice -n 10 python Testing/benchmarks/parts_speed.py --keep")]
    lines += [f"- {remark}" for remark in remarks]
    write_part(HERE / "RESULTS.md", "\n".join([*lines, "", "| part | ms |", "|---|---|", *rows]))


if __name__ == "__main__":
    main()
