"""Cheap work for batches, importable by their workers: it keeps a journal of what was begun and ended where."""

from __future__ import annotations

import argparse
import csv
import itertools
import os
import random
import signal
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from organphys.ground.checks import InputError
from organphys.pipeline.batch_case import register_case, work_case
from organphys.pipeline.batch_folder import RECORD
from organphys.pipeline.batch_records import DONE, KEPT

FILE, PAUSE_S = "result.txt", 0.02
KINDS = {0: "fine", 1: "bad", 2: "broken", 3: "deadly", 4: "slow", 5: "long"}
"""What becomes of a case, told by its seed."""


def write_table(folder: Path, rows: Sequence[Mapping[str, object]], name: str = "cases.csv") -> Path:
    """A table of cases beside the small files that they name."""
    for file in ("ct.nii.gz", "splat.ply"):
        (folder / file).touch()
    usual = {"labels": "ct.nii.gz", "organ": "5", "splat": "splat.ply"}
    columns = list(dict.fromkeys(["case", *usual, *(column for row in rows for column in row)]))
    with (folder / name).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        writer.writerows({**usual, **row} for row in rows)
    return folder / name


def cheap_case(arguments: argparse.Namespace, folder: Path) -> Mapping[str, Any]:
    """One small file instead of a registration; the seed says what goes wrong."""
    journal, kind = Path(arguments.splat).parent / "journal", KINDS[arguments.seed]
    note(journal, "begin", arguments.organ)
    (folder / "half.txt").write_text("half of it")
    time.sleep({"slow": 60, "long": 1}.get(kind, PAUSE_S))
    if kind == "bad":
        raise InputError("organ: nothing there;\ntake another label")
    if kind == "broken":
        raise RuntimeError("a bug")
    if kind == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    (folder / "half.txt").rename(folder / FILE)
    note(journal, "end", arguments.organ)
    return {"verdict": "trust", "error [mm]": 1.5}


def steady_case(arguments: argparse.Namespace, folder: Path) -> Mapping[str, Any]:
    """Cheap work that takes a tenth of a second."""
    time.sleep(0.08)
    return cheap_case(arguments, folder)


def tiny_register_case(arguments: argparse.Namespace, folder: Path) -> Mapping[str, Any]:
    """The real work at settings for tests."""
    from session_examples import tiny_problem

    with tiny_problem():
        return register_case(arguments, folder)


def kill_trials(folder: str, count: int) -> None:
    """Kill ``count`` processes that do one case again and again with changing settings; tell what each has left."""
    from organphys.pipeline.batch_table import read_batch

    cases = [read_batch(write_table(Path(folder), [{"case": "a", "fov": 50 + k}]))[0] for k in range(9)]
    out, rng = Path(folder) / "out", random.Random(0)
    begin = time.perf_counter()
    work_case(cases[0], out, quick_case)
    usual = time.perf_counter() - begin
    for _ in range(count):
        started, start = os.pipe()
        child = os.fork()
        if not child:
            os.write(start, b"x")
            for case in itertools.cycle(cases):
                assert work_case(case, out, quick_case).status in (DONE, KEPT)
        os.read(started, 1)
        time.sleep(rng.uniform(0, 3) * usual)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(started)
        os.close(start)
        held = sorted(path.name for path in (out / "a").iterdir()) if (out / "a").exists() else []
        print({"": "absent", f"{RECORD} {FILE}": "whole"}.get(" ".join(held), f"torn:{held}"))


def quick_case(arguments: argparse.Namespace, folder: Path) -> Mapping[str, Any]:
    (folder / FILE).write_text("half of it")
    time.sleep(0.003)
    return {}


def note(journal: Path, what: str, organ: str) -> None:
    with journal.open("a") as file:
        file.write(f"{what} {organ} {os.getpid()}\n")


def noted(folder: Path, what: str) -> list[tuple[str, int]]:
    """Organ and process of each ``what`` in the journal, in order."""
    journal = folder / "journal"
    lines = journal.read_text().splitlines() if journal.exists() else []
    return [(organ, int(pid)) for word, organ, pid in map(str.split, lines) if word == what]
