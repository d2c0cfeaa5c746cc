"""What the outcome of a stage must be when it comes from a file: arrays that belong together, and plain facts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..asset.array_archive import check_numbers
from ..ground.checks import LARGEST
from .case_outcome import CaseOutcome

PER_VERTEX = ("displacement_mm", "det_f", "error_68_mm", "error_95_mm")
LEVELS = ("trust", "check", "do not trust")
Check = Callable[[Any], bool]


def check_outcome(outcome: CaseOutcome) -> None:
    """ValueError where arrays do not belong together, or a fact is not of its kind."""
    if not isinstance(outcome.similarities, dict) or outcome.stage not in outcome.similarities:
        raise ValueError("its stage is not among the stages")
    _check_arrays(outcome)
    for name, good in FACTS.items():
        if not good(getattr(outcome, name)):
            raise ValueError(f"{name} is {str(getattr(outcome, name))[:40]!r}")


def _check_arrays(outcome: CaseOutcome) -> None:
    count = len(outcome.vertices_ct)
    inside = 0 if outcome.volume_ct is None else len(outcome.volume_ct)
    expected: dict[str, tuple[int, ...]] = {"vertices_ct": (count, 3), "camera_position": (3,)}
    expected |= {name: (count,) for name in PER_VERTEX}
    expected |= {name: (inside, 3) for name in ("volume_ct", "volume_scene")}
    found = {name: getattr(outcome, name) for name in expected}
    for name, shape in (("similarities", (4, 4)), ("surfaces", (count, 3)), ("distance_mm", (count,))):
        for stage, array in getattr(outcome, name).items():
            found[f"{name} {stage}"], expected[f"{name} {stage}"] = array, shape
    found = {name: array for name, array in found.items() if array is not None}
    for name, array in found.items():
        if not isinstance(array, np.ndarray) or array.dtype.kind != "f" or array.shape != expected[name]:
            raise ValueError(f"{name}: shape {np.shape(array)}, expected {expected[name]}")
    grids = () if outcome.grids is None else (outcome.grids.forward.vectors, outcome.grids.inverse.vectors)
    check_numbers(found | {f"grids {k}": vectors for k, vectors in enumerate(grids)}, "outcome")
    faces = outcome.faces
    if not isinstance(faces, np.ndarray) or faces.shape != (len(faces), 3) or faces.dtype.kind != "i":
        raise ValueError(f"faces: shape {np.shape(faces)}, expected (F, 3)")
    if faces.size and not 0 <= faces.min() <= faces.max() < count:
        raise ValueError("faces do not fit the vertices")


def _number(value: Any) -> bool:
    return type(value) in (int, float) and -LARGEST <= value <= LARGEST


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _each(good: Check) -> Check:
    """Of a mapping: whether all its values are good."""
    return lambda value: isinstance(value, Mapping) and all(good(entry) for entry in value.values())


def _listed(good: Check) -> Check:
    return lambda value: isinstance(value, (list, tuple)) and all(good(entry) for entry in value)


def _figure(value: Any) -> bool:
    return isinstance(value, Mapping) and "value" in value and _text(value.get("unit"))


def _twists(value: Any) -> bool:
    if value is None:
        return True
    numbers = _listed(_number)
    good = {"twists_deg": numbers, "costs": numbers, "cost_name": _text, "chosen_deg": _number}
    return _has(value, good) and len(value["twists_deg"]) == len(value["costs"])


def _verdict(value: Any) -> bool:
    reason: dict[str, Check] = {"code": _text, "level": LEVELS.__contains__, "message": _text}
    good: dict[str, Check] = {"level": LEVELS.__contains__, "headline": _text}
    return value is None or (_has(value, {**good, "reasons": _listed(lambda entry: _has(entry, reason))}))


def _has(value: Any, good: Mapping[str, Check]) -> bool:
    return isinstance(value, Mapping) and all(name in value and check(value[name]) for name, check in good.items())


FACTS: dict[str, Check] = {
    "mm_per_unit": lambda value: _number(value) and value > 0,
    "unit_stated": lambda value: isinstance(value, bool),
    "metrics": _each(_each(_figure)),
    "seconds": _each(_number),
    "stops": _each(_text),
    "facts": _each(_text),
    "twists": _twists,
    "steps": _listed(lambda entry: isinstance(entry, Mapping)),
    "verdict": _verdict,
    "asset": lambda value: value is None or isinstance(value, bytes),
}
