"""What landmarks, pins, regions, trajectories and points must be, told by a second reading of the same text."""

from __future__ import annotations

import csv
import json
from typing import Any

import numpy as np

from organphys.points.point_sets import Box, Landmarks
from organphys.points.trajectory import Trajectory
from organphys.readers.pins_file import PinMarks

LARGEST = 1e12


def landmarks_problem(name: str, content: bytes, landmarks: Landmarks) -> str | None:
    points = landmarks.points_ct
    if points.ndim != 2 or points.shape[1] != 3 or not _sound(points) or len(landmarks.names) != len(points):
        return f"points {points.shape}, {len(landmarks.names)} names"
    bad = [n for n in landmarks.names if not n.isprintable() or not 0 < len(n) <= 300]
    if bad:
        return f"a name that cannot be shown: {bad[0][:40]!r}"
    return _differ(name, content, points)


def _differ(name: str, content: bytes, points: np.ndarray) -> str | None:
    """Absolute coordinates against the file's; the axes' signs are the reader's business."""
    text = content.decode("utf-8-sig", errors="replace")
    if name.endswith(".json"):
        marks = [m for m in json.loads(text)["markups"] if m.get("type") != "ROI"]
        rows = [p["position"] for m in marks for p in m.get("controlPoints") or []
                if p.get("positionStatus", "defined") == "defined"]  # fmt: skip
        if any(type(v) not in (int, float) for row in rows for v in row):
            return "coordinates that are no numbers"
        return None if np.array_equal(np.abs(np.array(rows, dtype=float)), np.abs(points)) else "other coordinates"
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    return None if len(list(csv.reader(lines))) == len(points) else "another number of points"


def pins_problem(name: str, content: bytes, pins: PinMarks) -> str | None:
    if pins.radii_mm.shape != (len(pins.centres),) or not _sound(pins.radii_mm) or (pins.radii_mm <= 0).any():
        return f"radii {pins.radii_mm}"
    return landmarks_problem(name, content, Landmarks(pins.centres, pins.names))


def region_problem(content: bytes, box: Box) -> str | None:
    tree = json.loads(content.decode("utf-8-sig", errors="replace"))
    tree = tree["markups"][0] if "markups" in tree else tree.get("roi", tree) if isinstance(tree, dict) else tree
    for got, told in ((box.centre, tree["center"]), (box.size, tree["size"])):
        if any(type(v) not in (int, float) for v in told) or not np.array_equal(
            np.abs(got), np.abs(np.array(told, float))
        ):
            return "centre or size differ from the file's"
    if not _sound(box.centre) or not _sound(box.size) or (box.size <= 0).any():
        return "centre or size"
    return None if np.allclose(box.axes @ box.axes.T, np.eye(3), atol=2e-3) else "axes"


def trajectory_problem(name: str, content: bytes, path: Trajectory) -> str | None:
    count = len(path)
    if path.positions.shape != (count, 3) or path.rotations.shape != (count, 3, 3) or count < 1:
        return "shapes"
    if not all(_sound(part) for part in (path.times, path.positions, path.rotations, path.jaw_deg)):
        return "numbers"
    if (np.diff(path.times) <= 0).any() or not np.allclose(np.linalg.det(path.rotations), 1):
        return "times or rotations"
    if name.endswith(".json"):
        poses: list[dict[str, Any]] = json.loads(content.decode("utf-8-sig", errors="replace"))["poses"]
        told = [pose["position"] for pose in poses]
        if any(type(v) not in (int, float) for row in told for v in row) or len(told) != count:
            return "positions differ from the file's"
        return None if np.array_equal(np.abs(np.array(told, float)), np.abs(path.positions)) else "positions"
    return None


def points_problem(points: np.ndarray) -> str | None:
    return None if points.ndim == 2 and points.shape[1] == 3 and len(points) and _sound(points) else "points"


def _sound(values: np.ndarray) -> bool:
    return bool(np.isfinite(values).all() and (np.abs(values) <= LARGEST).all())
