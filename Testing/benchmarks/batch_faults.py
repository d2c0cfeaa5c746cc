"""A batch under bad days: workers killed at random, the command itself killed and interrupted, cases that fail.

    python Testing/benchmarks/batch_faults.py [--cases 200] [--kills 12] [--seed 0]

The work of a case is a small file and 0.1 s (Testing/core/batch_examples.py); everything else is organphys batch with
two local workers. The command is killed (-9) when a third of the cases is done and interrupted when two thirds are;
the same command goes on each time. Writes counts into RESULTS.md; ends with status 1 if a case was lost or torn.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from results_file import machine_lines, write_part

HERE = Path(__file__).resolve().parent
CORE = HERE.parent / "core"
sys.path.insert(0, str(CORE))
from batch_examples import FILE, noted, write_table  # noqa: E402

from organphys.pipeline.batch_folder import CaseFolder  # noqa: E402
from organphys.pipeline.commands_batch import SOME_FAILED  # noqa: E402

FAILING = {"an input error": 1, "an error of the program": 2}
PROGRAM = """
import sys
import batch_examples
from organphys.pipeline import commands_batch
from organphys.pipeline.command_line import main

if __name__ == "__main__":
    commands_batch.run.__kwdefaults__["work"] = batch_examples.steady_case
    sys.exit(main(sys.argv[1:]))
"""


def start(folder: Path, table: Path) -> subprocess.Popen[bytes]:
    """The command with two workers, in a session of its own."""
    program = folder / "program.py"
    program.write_text(PROGRAM)
    command = [sys.executable, str(program), "batch", str(table), "--out", str(folder / "out"), "--workers", "2"]
    environment = {**os.environ, "PYTHONPATH": str(CORE)}
    with (folder / "stderr.txt").open("w") as told:
        return subprocess.Popen(command, env=environment, stderr=told, start_new_session=True)


def trial(folder: Path, cases: int, kills: int, rng: random.Random) -> Counter[str]:
    """Run to the end through all faults; counts of what was done and found."""
    rows = [{"case": f"c{k:04d}", "organ": k, "seed": 1 + k % 2 if k % 20 == 7 else 0} for k in range(cases)]
    failing = {row["case"] for row in rows if row["seed"]}
    table, found = write_table(folder, rows), Counter[str]()
    process = start(folder, table)
    stops = [(cases // 3, signal.SIGKILL, "the command killed"), (2 * cases // 3, signal.SIGINT, "Ctrl-C")]
    due = sorted(rng.sample(range(5, cases - 20), kills))
    while process.poll() is None:
        time.sleep(0.02)
        ended = len(noted(folder, "end"))
        if stops and ended >= stops[0][0]:
            _, number, name = stops.pop(0)
            process.send_signal(number)
            process.wait(timeout=120)
            found[name] += 1
            process = start(folder, table)
        elif due and ended >= due[0]:
            due.pop(0)
            time.sleep(rng.uniform(0, 0.3))
            with suppress(ProcessLookupError):
                os.kill(noted(folder, "begin")[-1][1], signal.SIGKILL)
                found["workers killed"] += 1
    found["runs"] = 1 + found["the command killed"] + found["Ctrl-C"]
    found["exit code of the last run"] = process.returncode
    if process.returncode not in (0, SOME_FAILED):
        print((folder / "stderr.txt").read_text()[-4000:], file=sys.stderr)
    found.update(judged(folder, {str(row["case"]) for row in rows}, failing))
    return found


def judged(folder: Path, names: set[str], failing: set[str]) -> Counter[str]:
    """What lies in the folder at the end, and how often each case's work was begun and ended."""
    out, found = folder / "out", Counter[str]()
    for name in names:
        place = CaseFolder(out, name).place
        held = {path.name for path in place.iterdir()} if place.exists() else set()
        found["cases whole"] += held == {FILE, "batch.json"}
        found["cases torn"] += held not in ({FILE, "batch.json"}, set())
        found["cases lost"] += not held and name not in failing
        found["failed cases with results"] += bool(held) and name in failing
    begun, ended = (Counter(organ for organ, _ in noted(folder, what)) for what in ("begin", "end"))
    found["work begun"], found["work ended"] = sum(begun.values()), sum(ended.values())
    found["work ended twice"] = sum(count > 1 for count in ended.values())
    found["left over in .batch"] = sum(path.suffix != ".lock" for path in (out / ".batch").iterdir())
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--kills", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = trial(Path(folder), options.cases, options.kills, random.Random(options.seed))
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    lines = [f"| {name} | {number} |" for name, number in found.items()]
    text = "\n".join([
        "# Batch under faults",
        "",
        f"{options.cases} cases, one in twenty of which fails ({', '.join(FAILING)}), two local workers.",
        "Work that ended twice was killed between its end and the moment its folder appeared.",
        "",
        "| what | count |",
        "|---|---|",
        *lines,
        f"| processor time of all workers, s | {used.ru_utime + used.ru_stime:.0f} |",
        "",
        *machine_lines("python " + " ".join([os.path.relpath(__file__), *sys.argv[1:]])),
    ])  # fmt: skip
    write_part(HERE / "RESULTS.md", text)
    print(text)
    sys.exit(bool(found["cases torn"] or found["cases lost"]))


if __name__ == "__main__":
    main()
