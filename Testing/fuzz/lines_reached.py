"""The lines of organphys that inputs reach in one reader: the seeds alone, blind mutation, what is kept when guided.

python lines_reached.py CORPUS FOLDER READER COUNT    COUNT blind inputs against FOLDER/kept; one line of JSON
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FrameType
from typing import Any

from corpus import read_corpus
from kept import kept_inputs
from mutate import mutated, seed_of_input
from targets import TARGETS
from worker import Worker, confined, made_ready, overheard, warmed_up

import organphys

PACKAGE = str(Path(organphys.__file__).parent)
Line = tuple[str, int]


class Lines:
    """A tracer; functions of which every line has run are not followed any more."""

    def __init__(self) -> None:
        self.reached: set[Line] = set()
        self._left: dict[tuple[str, int, str], set[int]] = {}

    def __call__(self, frame: FrameType, event: str, argument: Any) -> Callable[..., Any] | None:
        code = frame.f_code
        if not code.co_filename.startswith(PACKAGE):
            return None
        key = (code.co_filename, code.co_firstlineno, code.co_name)
        if key not in self._left:
            self._left[key] = {line for *_, line in code.co_lines() if line}
        left = self._left[key]

        def step(frame: FrameType, event: str, argument: Any) -> Callable[..., Any]:
            if frame.f_lineno in left:
                left.discard(frame.f_lineno)
                self.reached.add((code.co_filename, frame.f_lineno))
            return step

        return step(frame, event, argument) if left else None


def reached(worker: Worker, reader: str, inputs: Iterable[tuple[str, bytes]]) -> set[Line]:
    """Lines that the inputs (name, content) run, their judging not counted."""
    read, lines = TARGETS[reader].read, Lines()
    for name, content in inputs:
        path = worker.folder / "in" / name
        path.write_bytes(content)
        sys.settrace(lines)
        try:
            read(path)
        except Exception:  # refused, or a failure that a campaign tells
            pass
        finally:
            sys.settrace(None)
            path.unlink()
    return lines.reached


def main(corpus: Path, folder: Path, reader: str, count: int) -> None:
    files = read_corpus(corpus, reader)
    with tempfile.TemporaryDirectory() as name:
        worker = Worker(corpus, Path(name), 0)
        made_ready(corpus, worker.folder)
        overheard(worker.folder)
        warmed_up(worker, {reader})
        confined()
        seeds = reached(worker, reader, files.items())
        blind = reached(worker, reader, (mutated(files, seed_of_input(reader, 0, k)) for k in range(count)))
        guided = reached(worker, reader, kept_inputs(corpus, reader, folder / "kept"))
    blind, guided = blind | seeds, guided | seeds
    only = sorted(f"{Path(file).name}:{line}" for file, line in guided - blind)
    told = {"seeds": len(seeds), "blind": len(blind), "guided": len(guided), "only_guided": only}
    print(json.dumps(told | {"only_blind": len(blind - guided), "blind_inputs": count}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
