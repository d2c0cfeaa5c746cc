"""The campaign of faults; it goes on where it stopped.

    make faults                                              540 trials, and 300 of the Slicer modules
    python Testing/faults/campaign.py --trials 60 --minutes 10

RESULTS.md gets its part.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy: a child inherits no threads
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "core"), str(HERE.parent / "benchmarks")]

from big import run_big  # noqa: E402
from commands import NAMES, Commands  # noqa: E402
from draw import draw  # noqa: E402
from scene_part import run_scene_trials  # noqa: E402
from tables import write_results  # noqa: E402
from trial import can_mount, measured, run_trial  # noqa: E402

OUTPUT = HERE.parent / "output" / "faults"


def main(arguments: list[str] | None = None) -> int:
    """The command; 1 where something failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=540, help="of the commands, those of earlier runs counted")
    parser.add_argument("--scene-trials", type=int, default=300, help="of the Slicer modules, likewise")
    parser.add_argument("--seed", type=int, default=0, help="another one gives other faults")
    parser.add_argument("--minutes", type=float, default=1e9, help="of processor time for the commands, then it stops")
    parser.add_argument("--big", action=argparse.BooleanOptionalAction, default=True, help="a large CT and splat too")
    parser.add_argument("--again", action="store_true", help="forget earlier failures and try these trials again")
    parser.add_argument("--results", type=Path, default=HERE.parent / "benchmarks" / "RESULTS.md")
    options = parser.parse_args(arguments)
    os.nice(10)
    OUTPUT.mkdir(parents=True, exist_ok=True)
    state = _loaded()
    if options.again:
        state["commands"] = {key: row for key, row in state["commands"].items() if not row["failure"]}
    _commands(options, state)
    if options.big:
        run_big(state)
        _save(state)
    run_scene_trials(options.scene_trials, state, _save)
    write_results(options.results, state, options.trials, options.scene_trials)
    scenes = state["scenes"].values()
    big = all("; registered, " in told for told in state["big"].values())
    return int(not big or any(row["failure"] for row in [*state["commands"].values(), *scenes]))


def _commands(options: argparse.Namespace, state: dict) -> None:
    keys = [f"{options.seed}:{k}" for k in range(options.trials)]
    if all(key in state["commands"] for key in keys):
        return
    folder = Path(tempfile.mkdtemp(prefix="organphys-faults-"))
    try:
        commands, mounts, sizes = Commands(folder), can_mount(folder), {}
        for name in NAMES:
            commands.compute(name)
            (folder / f"size_{name}").mkdir()
            sizes[name] = measured(commands, name, folder / f"size_{name}")
            print(f"{name}: {sizes[name].events} file events, {sizes[name].total} bytes", flush=True)
        for number, key in enumerate(keys):
            if key in state["commands"]:
                continue
            if sum(os.times()[:4]) > 60 * options.minutes:
                break
            place = folder / "trial"
            place.mkdir()
            name, fault, older = draw(options.seed, number, NAMES, sizes, mounts=mounts)
            verdict = run_trial(commands, sizes[name].names, name, fault, place, older=older)
            row = {"command": name, "kind": fault.kind, "at": fault.at, "older": older, **vars(verdict)}
            state["commands"][key] = row
            _save(state)
            if verdict.failure:
                print(f"{key} {name}, {fault}, older {older}: {verdict.failure}", flush=True)
            shutil.rmtree(place)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _loaded() -> dict:
    path = OUTPUT / "state.json"
    return json.loads(path.read_text()) if path.exists() else {"commands": {}, "scenes": {}, "growth": {}, "big": {}}


def _save(state: dict) -> None:
    temporary = OUTPUT / "state.part"
    temporary.write_text(json.dumps(state, indent=0))
    temporary.replace(OUTPUT / "state.json")


if __name__ == "__main__":
    sys.exit(main())
