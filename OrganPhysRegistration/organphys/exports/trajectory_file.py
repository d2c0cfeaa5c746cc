"""Trajectories as files that ``readers.trajectory_file`` reads, which documents them; also examples to start from."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..ground.atomic_file import write_text
from ..ground.checks import InputError
from ..ground.plain_json import dump
from ..points.trajectory import Trajectory

COLUMNS = ("time_s", "x", "y", "z", "qw", "qx", "qy", "qz", "jaw_deg")


def write_trajectory(path: str | os.PathLike[str], trajectory: Trajectory) -> None:
    """Write a .csv or .json, whole or not at all; numbers in full precision. InputError for another kind of file."""
    kind = Path(path).suffix.lower()
    if kind not in (".csv", ".json"):
        raise InputError(f"{path}: unknown kind of trajectory file; name it .csv or .json")
    quaternions = Rotation.from_matrix(trajectory.rotations).as_quat()[:, [3, 0, 1, 2]]
    if kind == ".csv":
        table = np.column_stack([trajectory.times, trajectory.positions, quaternions, trajectory.jaw_deg])
        lines = [f"# frame: {trajectory.frame}", f"# unit: {trajectory.unit}", ",".join(COLUMNS)]
        write_text(path, "\n".join([*lines, *(",".join(map(repr, row)) for row in table.tolist())]) + "\n")
        return
    rows = zip(trajectory.times, trajectory.positions, quaternions, trajectory.jaw_deg, strict=True)
    poses = [{"time_s": t, "position": p, "quaternion": q, "jaw_deg": jaw} for t, p, q, jaw in rows]
    header = {"format": "organphys-trajectory", "version": 1, "frame": trajectory.frame, "unit": trajectory.unit}
    write_text(path, dump({**header, "poses": poses}))
