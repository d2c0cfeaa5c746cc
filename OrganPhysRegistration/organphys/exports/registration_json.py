"""registration.json: the figures of one run for programs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from ..ground.atomic_file import write_text
from ..ground.notices import Notice
from ..ground.plain_json import dump

SCHEMA = 1


def write_registration_json(
    path: str | os.PathLike[str],
    *,
    method: str,
    scale_scene_per_mm: float,
    seconds: Mapping[str, float],
    peak_memory_mb: float | None,
    metrics: Mapping[str, Mapping[str, Mapping[str, Any]]],
    stops: Mapping[str, Any],
    warnings: Sequence[Notice],
    extra: Mapping[str, Any] | None = None,
) -> None:
    """Write schema 1, atomically: metrics {stage: {name: {"value", "unit"}}}; a number that is not finite is null.

    ``extra``: further top-level entries, none of the fixed names.
    """
    fixed = {
        "schema": SCHEMA,
        "method": method,
        "scale_scene_per_mm": scale_scene_per_mm,
        "seconds": seconds,
        "peak_memory_mb": peak_memory_mb,
        "metrics": metrics,
        "stops": stops,
        "warnings": [{"code": notice.code, "message": notice.message} for notice in warnings],
    }
    write_text(path, dump(fixed | {key: value for key, value in (extra or {}).items() if key not in fixed}))
