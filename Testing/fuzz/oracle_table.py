"""What times, splats of a sequence and cases of a batch must be, and the outcome of a stage."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from oracle_archive import _floats
from oracle_text import LARGEST

from organphys.pipeline.batch_records import BatchCase
from organphys.pipeline.case_outcome import CaseOutcome

TIMES = 3


def times_problem(content: bytes, times: np.ndarray) -> str | None:
    told = [float(word) for word in content.decode("utf-8-sig", errors="replace").split()]
    if times.tolist() != told or len(told) != TIMES or not (np.abs(times) <= LARGEST).all():
        return f"times {times}"
    return None if (np.diff(times) > 0).all() else "times that do not rise"


def frames_problem(content: bytes, files: list[Path]) -> str | None:
    lines = [line.strip() for line in content.decode("utf-8-sig", errors="replace").splitlines()]
    told = [Path(line).name for line in lines if line and line[0] != "#"]
    return None if [file.name for file in files] == told and len(told) >= 2 else f"{len(files)} files"


def cases_problem(content: bytes, cases: list[BatchCase]) -> str | None:
    names = [case.name.casefold() for case in cases]
    if not names or len(set(names)) < len(names):
        return "no case, or one twice"
    if any(not name.isprintable() or set(name) & set('/\\:"<>|?*') or name[0] == "." for name in names):
        return f"a name that is no folder: {names}"
    if not all(np.isfinite(case.arguments.camera).all() for case in cases):
        return "a camera that is not finite"
    rows = [row for row in csv.reader(content.decode("utf-8-sig").splitlines()) if any(row)]
    return None if len(rows) - 1 >= len(cases) else f"{len(cases)} cases of {len(rows)} lines"


def outcome_problem(outcome: CaseOutcome) -> str | None:
    for name, value in _floats(outcome):
        if not np.isfinite(value).all():
            return f"{name} not finite"
    for stage, surface in outcome.surfaces.items():
        if surface.shape != outcome.vertices_ct.shape or not np.isfinite(surface).all():
            return f"surface {stage}"
    if outcome.faces.size and not 0 <= outcome.faces.min() <= outcome.faces.max() < len(outcome.vertices_ct):
        return "faces"
    return (
        None if outcome.mm_per_unit > 0 and outcome.stage in outcome.metrics | outcome.similarities else "stage or unit"
    )
