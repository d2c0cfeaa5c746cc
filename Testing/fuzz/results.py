"""The campaign's part of RESULTS.md: inputs tried, what became of them, failures found and fixed."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from reader_trial import BASE_BYTES, MEGABYTE
from replay import found_files
from results_file import machine_lines, write_part
from supervised import Tally
from targets import TARGETS

TITLE = "# Hostile files"
LONG = (
    "thousands of members of a JSON object, the last of them twice: time grew with the square of their number",
    "thousands of columns of a batch's table: the same",
    "thousands of labels of landmarks on the splat: the same",
    "100,000 directions of a trajectory, each turned by itself, and cells kept as texts: 4 s, 50 MB",
    "a line of 300 kB in a PLY header taken apart into words: 7 MB",
    "a fiducial list of short lines: each a dictionary, 60 times the file's size",
    "a batch's table of up to 100,000 cases, each with files to read: 50 s; now at most 5000 cases",
)
"""What files long in one place found; tests make them again (test_hostile_files), no file of them is kept."""
GOAL = 200_000


def write_results(path: Path, state: dict[str, Tally], command: str) -> None:
    """Put the part of this campaign into RESULTS.md."""
    rows = {reader: _added(state, reader) for reader in TARGETS}
    fixed = Counter(name.split("_")[0] for name in found_files())
    table = [
        f"| {reader} | {t.tried:,} | {t.read:,} | {t.refused:,} | {len(t.failed)} | {fixed[reader]} "
        f"| {t.seconds / 60:.1f} |"
        for reader, t in rows.items()
    ]
    short = [reader for reader, tally in rows.items() if tally.tried < GOAL]
    lines = [
        TITLE,
        "",
        *machine_lines(command),
        "",
        "Seeds: every dialect of every reader, from the generated sample case and as 3DGS, gsplat, Nerfstudio, "
        "SuperSplat and 3D Slicer write their files; where case folders are there, also parts of their real files "
        "(label maps of patients in NIfTI with their own headers, splats, Slicer's markups, regions), from 60,000 "
        "inputs on.",
        "",
        f"Mutated files, read in a process of their own ({sum(t.tried for t in rows.values()):,} in all). "
        "Outcome: read (and equal to a second, plain reading of the bytes, or sound by its invariants), refused "
        "(InputError, one printable line), or failed: any other exception, a warning or text on stderr, a native "
        f"crash, more than 5 s of processor time, more memory than {BASE_BYTES // MEGABYTE} MB (in most of the inputs "
        "tried before November 23 it was 16) and "
        "twice what an intact file of that content takes, or a wrong success. Fixed: kinds of failure found while the "
        "harness was made and run, each kept as a file in Testing/fuzz/found that the standard tests try again; those "
        "of the archive that assets, sequences, recordings, cases and outcomes share stand under one of them.",
        "",
        "| reader | inputs | read | refused | failed, open | kinds found and fixed | minutes of one core |",
        "|---|---|---|---|---|---|---|",
        *table,
        "",
        *([f"Not reached: {GOAL:,} inputs for {', '.join(short)}; `make fuzz` goes on.", ""] if short else []),
        *_open(rows),
        "Found and fixed (files may show the same weakness in several readers):",
        "",
        *(f"- {cause} ({', '.join(sorted(who))})" for cause, who in _causes().items()),
        "",
        "Found and fixed by files that are long in one place, one input in five hundred from November 23 on and 100 "
        "more for each reader then:",
        "",
        *(f"- {cause}" for cause in LONG),
    ]
    write_part(path, "\n".join(lines) + "\n")


def _added(state: dict[str, Tally], reader: str) -> Tally:
    """Over all seeds."""
    total = Tally()
    for name, tally in state.items():
        if name.partition(":")[2] == reader:
            total.add(tally)
    return total


def _open(rows: dict[str, Tally]) -> list[str]:
    kinds = [(reader, what, found) for reader, tally in rows.items() for what, found in tally.failures.items()]
    lines = [f"- {reader}: {what} ({len(found)} times)" for reader, what, found in kinds]
    return ["Failures that are still open:", "", *lines, ""] if lines else []


def _causes() -> dict[str, set[str]]:
    causes: dict[str, set[str]] = {}
    for name, cause in sorted(found_files().items(), key=lambda entry: entry[1]):
        causes.setdefault(cause, set()).add(name.split("_")[0])
    return causes
