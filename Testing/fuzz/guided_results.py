"""The part of RESULTS.md on inputs guided by coverage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from results_file import machine_lines, write_part

TITLE = "# Hostile files, guided by coverage"


def write_results(path: Path, found: Mapping[str, Any], command: str) -> None:
    """``found``: reader -> what was tried there, as guided.py counts it."""
    rows = [
        f"| {reader} | {one.tried:,} | {one.lines['seeds']} | {one.lines['blind']} | {one.lines['guided']} "
        f"| {len(one.lines['only_guided'])} | {one.lines['only_blind']} | {len(one.failures)} "
        f"| {one.seconds / 60:.1f} |"
        for reader, one in found.items()
    ]
    total = {name: sum(one.lines[name] for one in found.values()) for name in ("seeds", "blind", "guided")}
    lines = [
        TITLE,
        "",
        *machine_lines(command),
        "",
        "libFuzzer (atheris) keeps each input that takes a new branch of organphys and mutates it further, by the "
        "campaign's mutations of each format and by its own of bytes; judged as in the campaign. Lines: those of "
        "organphys that run while the seeds are read, as many inputs without guidance, and all that was kept; "
        f"in all {total['seeds']:,}, {total['blind']:,} and {total['guided']:,}.",
        "",
        "| reader | inputs | lines: seeds | blind | guided | guided only | blind only | kinds of failure "
        "| minutes of one core |",
        "|---|---|---|---|---|---|---|---|---|",
        *rows,
        "",
        *(f"- {reader}: {what}" for reader, one in found.items() for what in one.failures),
    ]
    write_part(path, "\n".join(lines).rstrip() + "\n")
