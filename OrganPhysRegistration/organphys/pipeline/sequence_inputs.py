"""The splats of a sequence: a folder, a pattern or a list file, in their order, and their times."""

from __future__ import annotations

import glob
import os
import re
from pathlib import Path

import numpy as np

from ..ground.checks import LARGEST, Array, InputError, as_positive
from ..readers.json_file import read_text
from ..readers.plain_numbers import number_of

FEWEST, MOST = 2, 100_000


def splat_files(source: str) -> list[Path]:
    """The .ply files of a folder or a pattern such as "t_*.ply", names sorted as people count (t_2 before t_10); or of
    a .txt file with one path per line, from its own folder, in its order. InputError where there are less than two."""
    path = Path(source)
    if path.is_dir():
        found = sorted((p for p in path.iterdir() if p.suffix.lower() == ".ply" and p.is_file()), key=natural_key)
    elif path.suffix.lower() == ".txt":
        found = _listed(path)
    else:
        found = sorted((Path(p) for p in glob.glob(source) if p.lower().endswith(".ply")), key=natural_key)
    if len(found) < FEWEST:
        raise InputError(
            f"--splats {source}: found {len(found)} .ply files, a sequence has at least {FEWEST}; "
            'name their folder, a pattern in quotes ("t_*.ply") or a .txt file with one path per line'
        )
    return found


def natural_key(path: Path) -> tuple[list[tuple[int, str]], str]:
    """Sorts numbers in a name by their value."""
    parts = re.split(r"(\d+)", path.name.lower())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts if part], path.name


def frame_times(count: int, *, fps: float | None = None, file: str | None = None) -> tuple[Array, str]:
    """Times (count,) and their unit: k / fps in "s"; one number of seconds per line of ``file``; else the index, in
    "frame"."""
    if fps is not None and file is not None:
        raise InputError("--fps and --times: give one of them")
    if fps is not None:
        return np.arange(count) / as_positive(fps, "--fps"), "s"
    if file is None:
        return np.arange(float(count)), "frame"
    lines = [line.strip() for line in read_text(file).splitlines() if line.strip()]
    try:
        times = np.array([number_of(line) for line in lines])
    except ValueError as error:
        raise InputError(f"{file}: expected one number of seconds per line ({error})") from error
    if len(times) != count or not (np.abs(times) <= LARGEST).all() or (np.diff(times) <= 0).any():
        raise InputError(f"{file}: expected {count} rising numbers, one per splat, got {len(times)} lines")
    return times, "s"


def _listed(path: Path) -> list[Path]:
    lines = [line.strip() for line in read_text(path).splitlines()]
    lines = [line for line in lines if line and not line.startswith("#")]
    if len(lines) > MOST:
        raise InputError(f"{path}: more than {MOST} splats; give a part of them")
    found = [path.parent / line for line in lines]
    missing = [str(one) for one in found if not os.path.isfile(one)]  # a name too long for a file is missing too
    if missing:
        raise InputError(f"{path}: {len(missing)} of its {len(found)} files are missing, the first is {missing[0]}")
    return found
