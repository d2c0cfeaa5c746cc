"""The inputs of one case as a file for another process: mask, splat, and what the user stated."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..asset.array_archive import archive_bytes, read_archive
from ..ground.atomic_file import write_bytes
from ..ground.checks import LARGEST, Array, InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..points.point_sets import Box, Camera, GaussianCloud, Landmarks, SceneUnit

if TYPE_CHECKING:  # whoever writes a case need not load the stages
    from .registration import RegisterOptions
    from .session import RegistrationSession

CASE, HEADER = "case.npz", "case.json"
ORGAN_TYPES = {"name": (str,), "opening": (bool,), "close_holes": (bool,)}
OPTION_TYPES: dict[str, tuple[type, ...]] = {
    "method": (str,), "stiffness": (str, float, int), "seed": (int,), "opacity": (float, int), "weights": (str,),
    "clean": (bool,), "landmark_radius_mm": (float, int, type(None)),
}  # fmt: skip
SPLAT = ("centres", "opacities", "colours", "valid")


def save_case(
    folder: str | os.PathLike[str],
    *,
    mask: ArrayLike,
    ijk_to_ras: ArrayLike,
    splat: GaussianCloud,
    name: str = "organ",
    options: RegisterOptions | None = None,
    landmarks: Landmarks | None = None,
    camera: Camera | None = None,
    box: Box | None = None,
    unit: SceneUnit | None = None,
    opening: bool = True,
    close_holes: bool = False,
    provenance: Mapping[str, Any] | None = None,
    file: str = CASE,
) -> str:
    """Write ``folder``/``file``, atomically, and return ``file``.

    Arguments as of ``organ_from_mask`` and ``register``; they are judged where the case is loaded.
    """
    arrays = {f"splat/{part}": np.asarray(getattr(splat, part)) for part in SPLAT}
    arrays |= {"mask": np.asarray(mask).astype(bool), "ijk_to_ras": np.asarray(ijk_to_ras, dtype=np.float64)}
    header = {
        "organ": {"name": name, "opening": opening, "close_holes": close_holes},
        "splat_notices": [[notice.code, notice.message] for notice in splat.notices],
        "options": None if options is None else vars(options),
        "landmarks": None if landmarks is None else vars(landmarks),
        "camera": None if camera is None else vars(camera),
        "box": None if box is None else vars(box),
        "unit": None if unit is None else vars(unit),
        "provenance": dict(provenance or {}),
    }
    write_bytes(Path(folder) / file, archive_bytes(HEADER, header, arrays, sort_keys=False))
    return file


def load_case(path: str | os.PathLike[str], *, progress: Progress = no_progress) -> RegistrationSession:
    """A session over the case of ``save_case``; InputError for a damaged file and for inputs that cannot be used."""
    from ..readers.organ_from_mask import organ_from_mask
    from .session import RegistrationSession

    records = {"options": _options, "landmarks": _landmarks, "camera": Camera, "box": Box, "unit": SceneUnit}
    header, arrays = read_archive(path, HEADER)
    try:
        notices = tuple(Notice(str(code), str(message)) for code, message in header["splat_notices"])
        splat = _splat({part: arrays[f"splat/{part}"] for part in SPLAT}, notices)
        parts = {name: _record(header[name], kind) for name, kind in records.items()}
        mask, ijk_to_ras, of_organ = arrays["mask"], arrays["ijk_to_ras"], dict(header["organ"])
        _check_types(of_organ, ORGAN_TYPES)
        provenance = dict(header["provenance"])
    except InputError:
        raise
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{path}: damaged ({str(error)[:200]}); write the case again") from error
    organ = organ_from_mask(mask, ijk_to_ras, progress=progress, **of_organ)
    return RegistrationSession(organ, splat, provenance=provenance, progress=progress, **parts)


def _splat(parts: Mapping[str, np.ndarray], notices: tuple[Notice, ...]) -> GaussianCloud:
    """The splat, once its arrays are those of one."""
    count, seen = len(parts["valid"]), parts["valid"]
    shapes = {"centres": (count, 3), "opacities": (count,), "colours": (count, 3), "valid": (count,)}
    if any(parts[name].shape != shape for name, shape in shapes.items()) or seen.dtype != bool:
        raise InputError("case: the splat's arrays do not fit together; write the case again")
    opacities = parts["opacities"][seen]
    if not (np.abs(parts["centres"][seen]) <= LARGEST).all() or not ((opacities >= 0) & (opacities <= 1)).all():
        raise InputError("case: the splat holds numbers that no splat has; write the case again")
    return GaussianCloud(**parts, notices=notices)


def _check_types(values: Mapping[str, Any], types: Mapping[str, tuple[type, ...]]) -> None:
    for name, value in values.items():
        if type(value) not in types[name]:
            raise InputError(f"case: {name} is {str(value)[:40]!r}; write the case again")


def _options(**values: Any) -> RegisterOptions:
    from .registration import RegisterOptions

    _check_types(values, OPTION_TYPES)
    return RegisterOptions(**values)


def _landmarks(points_ct: Any, names: Any, points_scene: Any, pairs: Any) -> Landmarks:
    places = None if points_scene is None else _points(points_scene)
    numbers = None if pairs is None else tuple(int(k) for k in pairs)
    return Landmarks(_points(points_ct), tuple(map(str, names)), places, numbers)


def _points(rows: Any) -> Array:
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _record(values: Any, kind: Any) -> Any:
    """The record of its stored fields; None where there was none."""
    return None if values is None else kind(**values)
