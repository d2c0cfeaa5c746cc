"""Landmarks on the CT organ, RAS mm: from Slicer .mrk.json or .fcsv, or as text "x,y,z; x,y,z"."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

from ..ground.checks import LARGEST, Array, InputError, as_points, as_vector, one_line
from ..ground.frames import ras_from_lps
from ..points.point_sets import Landmarks
from .json_file import is_lps, markups_of, read_json, read_text
from .plain_numbers import number_of, plain_numbers

# every text matches in one way only, so that a long path cannot make the search explode
NUMBER = r"\s*[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?\s*"
LONGEST_NAME = 200
COORDINATES = re.compile(rf"(?:{NUMBER},{NUMBER},{NUMBER}(?:;|$))+\s*")


def read_landmarks(path_or_text: str | Path) -> Landmarks:
    """Landmarks of a .mrk.json (LPS or RAS), an .fcsv, or a text of RAS mm coordinates "x,y,z; x,y,z".

    InputError: unreadable, not in mm, or no landmark with a defined position.
    """
    text = str(path_or_text)
    if isinstance(path_or_text, str) and COORDINATES.fullmatch(text.strip()):
        return _from_text(text)
    path = Path(path_or_text)
    if os.path.isdir(text):
        raise InputError(f"{text}: this is a folder; name the landmark file in it")
    if not os.path.isfile(path):  # also False for names the system refuses
        raise InputError(f"{text}: no such file; give .mrk.json, .fcsv or coordinates as 'x,y,z; x,y,z' (RAS mm)")
    name = path.name.lower()
    if name.endswith(".json"):
        positions, names = _from_markups(path)
    elif name.endswith(".fcsv"):
        positions, names = _from_fcsv(path)
    else:
        raise InputError(f"{path}: unknown kind of landmark file; give .mrk.json or .fcsv")
    if not positions:
        raise InputError(f"{path}: no landmark in the file; place at least one point on the organ and save again")
    return Landmarks(as_points(positions, f"{path}: landmarks"), tuple(names))


def name_of(label: Any, number: int) -> str:
    """What a landmark is called: its label as it can be shown, else its number."""
    text = one_line(str(label), longest=LONGEST_NAME).strip() if isinstance(label, (str, int, float)) else ""
    return text or f"landmark {number}"


def describe_landmarks(path_or_text: str | Path) -> list[tuple[str, tuple[float, float, float]]]:
    """Name and RAS mm position of each landmark, for display."""
    landmarks = read_landmarks(path_or_text)
    rows = zip(landmarks.names, landmarks.positions.tolist(), strict=True)
    return [(name, (x, y, z)) for name, (x, y, z) in rows]


def _from_text(text: str) -> Landmarks:
    rows = [[float(number) for number in part.split(",")] for part in text.split(";") if part.strip()]
    return Landmarks(as_points(rows, "landmarks"), tuple(f"landmark {i + 1}" for i in range(len(rows))))


def _from_markups(path: Path) -> tuple[list[Any], list[str]]:
    """Control points with a defined position of all point-like markups (Slicer markups schema 1.0)."""
    positions, names = [], []
    for markup in markups_of(read_json(path), path):
        if markup.get("type") == "ROI":
            continue
        if str(markup.get("coordinateUnits", "mm")).strip("[]") not in ("mm", '"mm"'):
            units = str(markup["coordinateUnits"])[:40]
            raise InputError(f"{path}: coordinateUnits is {units!r}; save the markups in mm")
        lps, points = is_lps(markup, path), markup.get("controlPoints") or []
        if not isinstance(points, list) or not all(isinstance(point, dict) for point in points):
            raise InputError(f"{path}: controlPoints is not a list of points; save the markups again")
        for point in points:
            if point.get("positionStatus", "defined") != "defined":
                continue
            try:
                position = plain_numbers(point.get("position"), 3, f"{path}: position of a landmark")
            except InputError as error:
                raise InputError(f"{error}; save the landmarks again") from error
            positions.append(ras_from_lps(position) if lps else position)
            names.append(name_of(point.get("label"), len(positions)))
    return positions, names


def _position(cells: list[str | None], path: Path) -> Array:
    try:
        position = as_vector([number_of(cell) for cell in cells], "position")
    except ValueError:
        position = np.full(3, np.inf)
    if not (np.abs(position) <= LARGEST).all():
        shown = ", ".join(str(cell)[:20] for cell in cells)
        raise InputError(
            f"{path}: position of a landmark: expected three numbers, got {shown}; save the landmarks again"
        )
    return position


def _from_fcsv(path: Path) -> tuple[list[Any], list[str]]:
    """Slicer's former fiducial list: '# CoordinateSystem = 0 | RAS | 1 | LPS' and '# columns = id,x,y,z,...'.

    Slicer before 4.11 wrote 0 for RAS; without the line RAS is the historical meaning.
    """
    lines = read_text(path).splitlines()
    header = {k.strip().lower(): v.strip() for k, _, v in (x[1:].partition("=") for x in lines if x[:1] == "#")}
    system = header.get("coordinatesystem", "RAS").upper()
    if system not in ("0", "1", "RAS", "LPS"):
        raise InputError(f"{path}: CoordinateSystem {system[:20]!r} is neither RAS nor LPS; save the list again")
    columns = [c.strip() for c in header.get("columns", "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label").split(",")]
    if not {"x", "y", "z"} <= set(columns) or len(set(columns)) < len(columns):
        raise InputError(f"{path}: the columns line names no x, y, z, or one twice; save the list again")
    positions, names = [], []
    try:
        for row in csv.DictReader((x for x in lines if x.strip() and x[0] != "#"), fieldnames=columns):
            position = _position([row[axis] for axis in "xyz"], path)
            positions.append(ras_from_lps(position) if system in ("1", "LPS") else position)
            names.append(name_of(row.get("label"), len(positions)))
    except csv.Error as error:
        raise InputError(f"{path}: a line cannot be taken apart ({error}); save the list again") from error
    return positions, names
