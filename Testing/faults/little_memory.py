"""Exporting frames with little memory left, in a fresh process: what a long one has freed would hold the whole command.

    python Testing/faults/little_memory.py EMPTY_FOLDER MEGABYTES ...

Prints a line for each: how the command ended, what it left, and what is wrong with that.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1] / "core")]

from commands import Commands  # noqa: E402
from injected import MEGABYTE, Fault  # noqa: E402
from trial import measured, run_trial  # noqa: E402

NAME = "frames"


def main(folder: Path, megabytes: list[float]) -> None:
    for place in ("commands", "whole"):
        (folder / place).mkdir()
    commands = Commands(folder / "commands")
    commands.compute(NAME)
    names = measured(commands, NAME, folder / "whole").names
    for number, left in enumerate(megabytes):
        place = folder / str(number)
        place.mkdir()
        verdict = run_trial(commands, names, NAME, Fault("memory, whole", left * MEGABYTE), place, older=True)
        print(verdict.ended, verdict.left, verdict.failure, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [float(word) for word in sys.argv[2:]])
