"""The region of interest of a splat: a Slicer ROI markup, or JSON {"center", "size", "axes"} (also under "roi").

The box is in raw scene units. A Slicer ROI is taken by its numbers as raw scene coordinates in the coordinate system it
states: RAS numbers as they are, LPS with x and y turned back. (Inside Slicer, where the splat lies under a transform
scene -> world, the module converts the ROI itself.)
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..ground.checks import Array, InputError
from ..ground.frames import ras_from_lps
from ..points.point_sets import Box
from .json_file import is_lps, markups_of, read_json
from .plain_numbers import plain_numbers


def read_box(path: str | Path) -> Box:
    """Oriented box of a .mrk.json with one ROI or of a JSON file; ``axes`` are three unit rows, default the frame's."""
    path = Path(path)
    content = read_json(path)
    if isinstance(content, dict) and "markups" in content:
        return _from_markup(content, path)
    if isinstance(content, dict) and isinstance(content.get("roi"), dict):
        content = content["roi"]
    if not isinstance(content, dict) or "center" not in content or "size" not in content:
        raise InputError(f"{path}: holds no region; give a Slicer ROI markup or JSON with center and size")
    rows = content.get("axes")
    if rows is None:
        axes = np.eye(3)
    elif isinstance(rows, list) and len(rows) == 3:
        axes = np.stack([_numbers(row, 3, "axes", path) for row in rows])
    else:
        axes = _numbers(rows, 9, "axes", path).reshape(3, 3)
    return _box(content["center"], content["size"], axes, path)


def describe_box(path: str | Path) -> dict[str, list[Any]]:
    """Centre, size and axes of a region file, for display."""
    box = read_box(path)
    return {"center": box.centre.tolist(), "size": box.size.tolist(), "axes": box.axes.tolist()}


def _from_markup(content: Any, path: Path) -> Box:
    regions = [m for m in markups_of(content, path) if m.get("type") == "ROI"]
    if len(regions) != 1:
        raise InputError(f"{path}: {len(regions)} ROI markups in the file, expected one; save the ROI by itself")
    region = regions[0]
    if str(region.get("roiType", "Box")) not in ("Box", "BoundingBox"):
        raise InputError(f"{path}: ROI type {str(region['roiType'])[:40]!r} is not supported; use a box")
    orientation = region.get("orientation")
    axes = np.eye(3) if orientation is None else _numbers(orientation, 9, "orientation", path).reshape(3, 3).T
    centre = _numbers(region.get("center"), 3, "center", path)  # columns of the orientation are the axes
    if is_lps(region, path):
        centre, axes = ras_from_lps(centre), ras_from_lps(axes)
    return _box(centre.tolist(), region.get("size"), axes, path)


def _box(centre: Any, size: Any, axes: Array, path: Path) -> Box:
    try:
        return Box(_numbers(centre, 3, "center", path), _numbers(size, 3, "size", path), axes)
    except InputError as error:
        raise InputError(str(error) if str(path) in str(error) else f"{path}: {error}") from error


def _numbers(value: Any, count: int, name: str, path: Path) -> Array:
    try:
        return plain_numbers(value, count, f"{path}: {name}")
    except InputError as error:
        raise InputError(f"{error}; save the region again") from error
