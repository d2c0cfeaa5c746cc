"""JSON and text files from outside: bounded in size, and every failure an InputError."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ..ground.checks import InputError
from ..ground.strict_json import parse_json

MAX_JSON_BYTES = 16_000_000


def read_text(path: str | Path) -> str:
    """The text of a file of at most 16 MB; bytes that are no UTF-8 are replaced."""
    path = Path(path)
    if os.path.isdir(path):
        raise InputError(f"{path}: this is a folder; name a file in it")
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file; check the path")
    try:
        if path.stat().st_size > MAX_JSON_BYTES:
            raise InputError(f"{path}: larger than {MAX_JSON_BYTES // 1_000_000} MB, so not the file expected here")
        return path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error


def read_json(path: str | Path) -> Any:
    """The parsed content of a JSON file of at most 16 MB."""
    text = read_text(path)
    try:
        return parse_json(text)
    except ValueError as error:
        raise InputError(f"{path}: no valid JSON ({str(error)[:120]}); save the file again") from error


def markups_of(content: Any, path: Path) -> list[dict[str, Any]]:
    """The markups of a Slicer .mrk.json; InputError where there are none."""
    markups = content.get("markups") if isinstance(content, dict) else None
    if not isinstance(markups, list) or not all(isinstance(m, dict) for m in markups) or not markups:
        raise InputError(f"{path}: holds no Slicer markups; save the markups node from 3D Slicer as .mrk.json")
    return markups


def is_lps(markup: dict[str, Any], path: Path) -> bool:
    """Whether a markup's numbers are LPS (else RAS); Slicer writes the names, its first schema also wrote 0 and 1."""
    system = str(markup.get("coordinateSystem", "LPS")).upper()
    if system not in ("LPS", "RAS", "0", "1"):
        raise InputError(f"{path}: coordinateSystem {system[:20]!r} is neither LPS nor RAS; save the markups again")
    return system in ("LPS", "1")
