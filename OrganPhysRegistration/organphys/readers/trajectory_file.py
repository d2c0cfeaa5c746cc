"""Trajectory files, CSV or JSON: poses of the tip of an instrument over time.

CSV: lines "# frame: scene" and "# unit: mm" (see ``Trajectory`` for the names; an "axes" line "RAS" or "LPS" for frame
ct, RAS if absent), a row of column names, and one row per pose. Columns, in any order:

    time_s, x, y, z, jaw_deg        the tip of the closed jaws, and the opening (0 if the column is absent)
    qw, qx, qy, qz                  rotation of the tool (z forward to the tip, x along the hinge of the jaws), or
    dx, dy, dz, roll_deg            its direction, and the turn about it (0 if absent), see ``rotation_along``

JSON: {"format": "organphys-trajectory", "version": 1, "frame": "scene", "unit": "mm", "poses": [{"time_s": 0,
"position": [x, y, z], "quaternion": [w, x, y, z], "jaw_deg": 30}, ...]}, with "direction": [x, y, z] and "roll_deg" in
place of the quaternion if wished.
"""

from __future__ import annotations

import csv
from array import array
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..ground.checks import LARGEST, Array, InputError
from ..ground.frames import ras_from_lps
from ..points.trajectory import MOST_POSES, Trajectory, rotations_along
from .json_file import read_json, read_text
from .plain_numbers import number_of, plain_number, plain_numbers

FORMAT, VERSION = "organphys-trajectory", 1
QUATERNION, DIRECTION = ("qw", "qx", "qy", "qz"), ("dx", "dy", "dz")
KNOWN = {"time_s", "x", "y", "z", "jaw_deg", "roll_deg", *QUATERNION, *DIRECTION}
LPS_TURN = np.diag([-1.0, -1.0, 1.0])


def read_trajectory(path: str | Path) -> Trajectory:
    """The trajectory of a .csv or .json file; InputError says what is wrong and where."""
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".csv", ".json"):
        raise InputError(f"{path}: unknown kind of trajectory file; give .csv or .json")
    try:
        header, table = _csv(path) if kind == ".csv" else _json(path)
    except (OverflowError, csv.Error) as error:
        raise InputError(f"{path}: a number or a cell is too long ({error}); write the file again") from error
    try:
        return _trajectory(header, table)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _trajectory(header: dict[str, str], table: dict[str, Array]) -> Trajectory:
    """From columns (T,) by name; those of JSON are named in the same way."""
    missing = [name for name in ("time_s", "x", "y", "z") if name not in table]
    if missing or not (set(QUATERNION) <= set(table) or set(DIRECTION) <= set(table)):
        raise InputError(
            f"trajectory: {'no ' + ', '.join(missing) if missing else 'no rotation'}; it needs time_s, x, y, z and "
            f"either {', '.join(QUATERNION)} or {', '.join(DIRECTION)}, roll_deg"
        )
    positions = np.stack([table[name] for name in "xyz"], axis=1)
    if not (np.abs(np.stack(list(table.values()))) <= LARGEST).all():
        raise InputError(
            "trajectory: a number is missing or not finite or beyond 1e12; fill every column of every pose"
        )
    rotations = _quaternions(table) if "qw" in table else _directions(table)
    frame, axes = header.get("frame", "").lower(), header.get("axes", "RAS").upper()
    if not frame:
        raise InputError("trajectory: frame is not stated; write 'scene', 'ct' or 'm' (and the unit)")
    if axes not in ("RAS", "LPS") or (axes == "LPS" and frame != "ct"):
        raise InputError(f"trajectory: axes {axes[:20]!r} in frame {frame[:20]!r}; RAS or LPS belong to frame 'ct'")
    if axes == "LPS":
        positions, rotations = ras_from_lps(positions), LPS_TURN @ rotations
    jaw = table.get("jaw_deg", np.zeros(len(positions)))
    return Trajectory(table["time_s"], positions, rotations, jaw, frame, header.get("unit", "").lower())


def _quaternions(table: dict[str, Array]) -> Array:
    values = np.stack([table[name] for name in QUATERNION], axis=1)
    length = np.sqrt((values**2).sum(1))
    if (np.abs(length - 1) > 0.01).any():
        row = int(np.abs(length - 1).argmax())
        raise InputError(f"trajectory: the quaternion of pose {row + 1} has length {length[row]:.3g}, not 1")
    matrices: Array = Rotation.from_quat(values[:, [1, 2, 3, 0]]).as_matrix()
    return matrices


def _directions(table: dict[str, Array]) -> Array:
    directions = np.stack([table[name] for name in DIRECTION], axis=1)
    if (np.sqrt((directions**2).sum(1)) < 1e-9).any():
        raise InputError("trajectory: a direction dx, dy, dz has no length")
    roll = table.get("roll_deg", np.zeros(len(directions)))
    return rotations_along(directions, roll)


def _csv(path: Path) -> tuple[dict[str, str], dict[str, Array]]:
    """The "# key: value" lines and the columns."""
    header: dict[str, str] = {}
    names: list[str] = []
    values = array("d")  # row by row: cells as texts take several times the memory
    for number, row in enumerate(csv.reader(read_text(path).splitlines()), start=1):
        text = ",".join(row).strip()
        if text.startswith("#"):
            key, _, value = text.lstrip("# ").partition(":")
            header[key.strip().lower()] = value.strip()
        elif text.strip(", "):
            if names:
                values.extend(_csv_row(row, len(names), path, number))
            else:
                names = _csv_names(row, path)
        if len(values) > MOST_POSES * len(names):
            raise InputError(f"{path}: more than {MOST_POSES} poses; thin them out")
    if not values:
        raise InputError(f"{path}: no poses; write a row of column names and one row per pose below it")
    table = np.array(values).reshape(-1, len(names))
    return header, dict(zip(names, table.T, strict=True))


def _csv_names(row: list[str], path: Path) -> list[str]:
    names = [cell.strip().lower() for cell in row]
    unknown = [name for name in names if name not in KNOWN]
    if unknown or len(set(names)) < len(names):
        raise InputError(
            f"{path}: column {(unknown or names)[0][:40]!r} is unknown or twice; known: {', '.join(sorted(KNOWN))}"
        )
    return names


def _csv_row(row: list[str], count: int, path: Path, number: int) -> list[float]:
    try:
        numbers = [number_of(cell) for cell in row]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        raise InputError(f"{path}: line {number} is not {count} numbers separated by commas")
    return numbers


def _json(path: Path) -> tuple[dict[str, str], dict[str, Array]]:
    content = read_json(path)
    if not isinstance(content, dict) or content.get("format") != FORMAT or content.get("version") != VERSION:
        raise InputError(f'{path}: is no trajectory; it begins {{"format": "{FORMAT}", "version": {VERSION}, ...')
    poses = content.get("poses")
    if not isinstance(poses, list) or not poses or not all(isinstance(pose, dict) for pose in poses):
        raise InputError(f"{path}: 'poses' must be a list of at least one pose")
    if len(poses) > MOST_POSES:
        raise InputError(f"{path}: more than {MOST_POSES} poses; thin them out")
    rows = [_json_pose(pose, f"{path}: pose {k + 1}") for k, pose in enumerate(poses)]
    if any(set(row) != set(rows[0]) for row in rows):
        raise InputError(f"{path}: all poses must give their rotation in the same way, quaternion or direction")
    table = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return {name: str(content[name]) for name in ("frame", "unit", "axes") if name in content}, table


def _json_pose(pose: dict[str, Any], name: str) -> dict[str, float]:
    """One pose as columns; InputError names it."""
    out = dict(zip("xyz", plain_numbers(pose.get("position"), 3, f"{name}: position").tolist(), strict=True))
    out["time_s"] = plain_number(pose.get("time_s"), f"{name}: time_s")
    out["jaw_deg"] = plain_number(pose.get("jaw_deg", 0.0), f"{name}: jaw_deg")
    if "quaternion" in pose:
        turn = plain_numbers(pose["quaternion"], 4, f"{name}: quaternion, w first")
        out |= dict(zip(QUATERNION, turn.tolist(), strict=True))
    elif "direction" in pose:
        turn = plain_numbers(pose["direction"], 3, f"{name}: direction")
        out |= dict(zip(DIRECTION, turn.tolist(), strict=True))
        out["roll_deg"] = plain_number(pose.get("roll_deg", 0.0), f"{name}: roll_deg")
    else:
        raise InputError(f"{name}: give its quaternion [w, x, y, z] or its direction [x, y, z]")
    return out
