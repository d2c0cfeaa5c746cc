"""Fields of an INRIA-layout PLY sorted into the full record of Gaussians."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..points.gaussians import LOGIT_LIMIT, SH_C0, Gaussians, colour_from_sh
from .ply_columns import Rows, finite_rows, stack_columns

CENTRE = ("x", "y", "z")
DC = ("f_dc_0", "f_dc_1", "f_dc_2")
ROTATION = ("rot_0", "rot_1", "rot_2", "rot_3")
COLOUR = ("red", "green", "blue")
COEFFICIENTS = {0: 0, 3: 1, 8: 2, 15: 3, 24: 4}  # per channel, without the constant one: degree


def gaussians_from_rows(rows: Rows, *, path: Path, progress: Progress = no_progress) -> Gaussians:
    """Full record of uncompressed vertex rows; every field that is not a Gaussian's own is kept in ``extra``."""
    names = rows.dtype.names or ()
    rest = rest_names(names, path)
    scales = tuple(n for n in ("scale_0", "scale_1", "scale_2") if n in names)
    rotation = ROTATION if all(n in names for n in ROTATION) else ()
    dc = DC if all(n in names for n in DC) else ()
    count = len(rows)
    opaque = np.full(count, LOGIT_LIMIT, dtype=np.float32)
    known = {*CENTRE, *scales, *rotation, *dc, *rest, "opacity"}
    colours = plain_colours(rows)
    with np.errstate(invalid="ignore"):  # signalling NaNs, which are masked
        neutral = np.zeros((count, 3), dtype=np.float32) if colours is None else (colours - 0.5) / SH_C0
    return Gaussians(
        means=stack_columns(rows, CENTRE),
        log_scales=stack_columns(rows, scales),
        quaternions=stack_columns(rows, rotation),
        opacity_logits=stack_columns(rows, ("opacity",))[:, 0] if "opacity" in names else opaque,
        sh_dc=stack_columns(rows, dc) if dc else neutral,
        sh_rest=stack_columns(rows, rest).reshape(count, 3, len(rest) // 3),
        valid=finite_rows(rows, progress=progress),
        extra={n: np.array(rows[n]).astype(rows.dtype[n].newbyteorder("=")) for n in names if n not in known},
    )


def plain_colours(rows: Rows) -> NDArray[np.floating] | None:
    """Colours (N, 3) in 0..1 from f_dc or from red, green, blue (whole numbers by their range); None without any."""
    names = rows.dtype.names or ()
    if all(n in names for n in DC):
        with np.errstate(invalid="ignore"):  # signalling NaNs, which are masked
            return colour_from_sh(stack_columns(rows, DC))
    if not all(n in names for n in COLOUR):
        return None
    colours = stack_columns(rows, COLOUR)
    kind = rows.dtype["red"]
    if {rows.dtype[name] for name in COLOUR} != {kind}:
        return None
    if kind.kind in "iu":
        colours /= np.iinfo(kind).max
    return np.clip(colours, 0, 1)


def non_finite_notices(valid: NDArray[np.bool_]) -> tuple[Notice, ...]:
    """The notice that Gaussians were masked, if any were."""
    count = int((~valid).sum())
    if count == 0:
        return ()
    text = f"{count} of {len(valid)} Gaussians hold numbers that are not finite; they are masked and keep their index."
    return (Notice("non_finite_gaussians", text),)


def rest_names(names: tuple[str, ...], path: Path) -> tuple[str, ...]:
    """f_rest_0 .. f_rest_(n-1) in numeric order; InputError unless n is 0, 9, 24, 45 or 72."""
    count = sum(bool(re.fullmatch(r"f_rest_\d+", name)) for name in names)
    rest = tuple(f"f_rest_{i}" for i in range(count))
    if count % 3 or count // 3 not in COEFFICIENTS or not set(rest) <= set(names):
        raise InputError(f"{path}: {count} f_rest fields are no whole degree of spherical harmonics; export it again")
    return rest


def sh_degree(names: tuple[str, ...]) -> int:
    """Degree of the spherical harmonics by the number of f_rest fields; -1 where they make no whole degree."""
    count = sum(name.startswith("f_rest_") for name in names)
    return COEFFICIENTS.get(count // 3, -1) if count % 3 == 0 else -1
