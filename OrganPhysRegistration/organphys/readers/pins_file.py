"""Pinned regions (ligaments, vessels) as points with radii: Slicer markups, fiducial lists or plain coordinates."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..ground.checks import Array, InputError, as_points, as_positive
from .json_file import markups_of, read_json
from .landmarks_file import read_landmarks

RADIUS_MM = 10.0
LARGEST_RADIUS_MM = 1000.0
LAST = 80  # characters of a description in which its radius stands
_RADIUS = re.compile(r"\br(?:adius)?\s*=\s*([0-9]*\.?[0-9]+)\s*(mm)?\s*$", re.IGNORECASE)


@dataclass(frozen=True)
class PinMarks:
    """Centres (N, 3) in CT RAS mm, radii_mm (N,) and names of pinned regions."""

    centres: Array
    radii_mm: Array
    names: tuple[str, ...]


def read_pins(path_or_text: str | Path, *, radius_mm: float = RADIUS_MM) -> PinMarks:
    """Pins of a .mrk.json or .fcsv, or of a text of RAS mm coordinates "x,y,z; x,y,z".

    A control point of a .mrk.json whose description ends in "r=12" has a radius of 12 mm; all others ``radius_mm``.
    InputError: unreadable, not in mm, no point, or a radius that is none.
    """
    as_positive(radius_mm, "pin radius")
    marks = read_landmarks(path_or_text)
    radii = np.full(len(marks.positions), radius_mm)
    if str(path_or_text).lower().endswith(".json"):
        radii = np.array([_radius(text, radius_mm, path_or_text) for text in _descriptions(Path(path_or_text))])
    return PinMarks(as_points(marks.positions, "pins"), radii, marks.names)


def _descriptions(path: Path) -> list[str]:
    """Description of every control point that ``read_landmarks`` takes, in its order."""
    out: list[str] = []
    for markup in markups_of(read_json(path), path):
        if markup.get("type") != "ROI":
            points: list[dict[str, Any]] = markup.get("controlPoints") or []
            defined = [point for point in points if point.get("positionStatus", "defined") == "defined"]
            out += [str(point.get("description") or "") for point in defined]
    return out


def _radius(description: str, otherwise: float, path: str | Path) -> float:
    found = _RADIUS.search(description.rstrip()[-LAST:])
    if found is None:
        return otherwise
    radius = float(found.group(1))
    if not 0 < radius <= LARGEST_RADIUS_MM:
        raise InputError(
            f"{path}: a pin's description {description[-LAST:]!r} gives a radius of {radius:g} mm, expected above 0 "
            f"and up to {LARGEST_RADIUS_MM:g}; write for instance r=12"
        )
    return radius
