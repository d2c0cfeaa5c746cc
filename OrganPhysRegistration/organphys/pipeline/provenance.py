"""What a result tells about its making. Light: whoever only compares inputs loads no reader and no stage."""

from __future__ import annotations

import argparse
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import __version__


def provenance_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """What the asset tells about its making: versions, options, and name and SHA-256 of each input file."""
    files = {name: getattr(arguments, name) for name in ("labels", "splat", "landmarks", "splat_landmarks", "roi")}
    texts = ("organ", "label_scheme", "camera", "fov", "mm_per_unit", "opacity", "clean", "method", "stiffness")
    more = ("weights", "seed", "no_opening", "close_holes")
    return {
        "organphys": __version__,
        "inputs": {name: fingerprint(value) for name, value in files.items() if value is not None},
        "options": {name: getattr(arguments, name) for name in (*texts, *more)},
    }


def fingerprint(value: str) -> Mapping[str, str]:
    """Name and SHA-256 of a file; a text that names none stands for itself."""
    path = Path(value)
    if not path.is_file():
        return {"text": value}
    with path.open("rb") as file:
        digest = hashlib.sha256()
        while block := file.read(1 << 20):
            digest.update(block)
    return {"file": path.name, "sha256": digest.hexdigest()}
