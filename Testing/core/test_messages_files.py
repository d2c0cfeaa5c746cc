"""Messages about small files and folders, as far as no other test raises them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from organphys.asset.sequence_file import load_sequence
from organphys.exports.trajectory_file import write_trajectory
from organphys.ground.atomic_file import write_text
from organphys.ground.checks import InputError
from organphys.pipeline.batch_table import read_batch
from organphys.pipeline.commands_info import run as info
from organphys.pipeline.evaluation import read_truth
from organphys.pipeline.points_file import read_points
from organphys.pipeline.sequence_inputs import frame_times, splat_files
from organphys.points.trajectory import Trajectory
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.roi_file import read_box
from organphys.readers.trajectory_file import read_trajectory

PATH = Trajectory(np.arange(2.0), np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)), np.zeros(2))
FILES: dict[str, tuple[str, str, Callable[[Path], object]]] = {
    "holds no region": ("box.json", "{}", read_box),
    "1 of its 1 files are missing": ("list.txt", "nothing.ply", lambda path: splat_files(str(path))),
    "expected 3 rising numbers": ("times.txt", "0\n1\n", lambda path: frame_times(3, file=str(path))),
    "one number of seconds per line": ("words.txt", "now", lambda path: frame_times(1, file=str(path))),
    "more than 100000 splats": ("long.txt", "a.ply\n" * 100_001, lambda path: splat_files(str(path))),
    "more than 5000 cases": ("cases.csv", "a\n" * 5002, read_batch),
    "unknown kind of point file": ("points.txt", "1,2,3", read_points),
    "row 2 is not three numbers": ("points.csv", "1,2,3\n1,2\n", read_points),
    "unknown kind of trajectory file; give": ("path.txt", "", read_trajectory),
    "name it .csv or .json": ("path.txt", "", lambda path: write_trajectory(path, PATH)),
    "'poses' must be a list": (
        "path.json", '{"format": "organphys-trajectory", "version": 1, "frame": "m", "poses": []}', read_trajectory
    ),
    "is unknown or twice": ("path.csv", "# frame: m\ntime_s,x,y,z,colour\n0,0,0,0,1\n", read_trajectory),
    "the columns line names no x": ("list.fcsv", "# columns = id,label\n1,a\n", read_landmarks),
    "is no OrganPhys sequence": ("organ.organphys-seq", "", lambda path: load_sequence(_renamed(path))),
    "not the truth of a case": ("truth.npz", "", lambda path: read_truth(_empty_archive(path))),
    "-m: no such file": ("x", "", lambda path: info(argparse.Namespace(file=f"{path}-m", label_scheme=None))),
}  # fmt: skip


def _renamed(path: Path) -> Path:
    """An archive with the header of a sequence that is none."""
    from organphys.asset.array_archive import archive_bytes

    path.write_bytes(archive_bytes("sequence.json", {"format": "other"}, {}))
    return path


def _empty_archive(path: Path) -> Path:
    np.savez(path, other=np.zeros(1))
    return path


@pytest.mark.parametrize("words", FILES)
def test_files(words: str, tmp_path: Path) -> None:
    name, content, read = FILES[words]
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(words)):
        read(tmp_path / name)


FOLDERS: dict[str, Callable[[Path], object]] = {
    "name a file inside it": lambda path: write_text(path, "x"),
    "name a .npy or .csv file in it": read_points,
    "name the landmark file in it": read_landmarks,
    "this is a folder; name a file in it": lambda path: info(argparse.Namespace(file=str(path), label_scheme=None)),
}


@pytest.mark.parametrize("words", FOLDERS)
def test_folders(words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words):
        FOLDERS[words](tmp_path)
