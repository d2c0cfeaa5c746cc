"""The seed corpus on disk: FOLDER/READER/NAME."""

from __future__ import annotations

from pathlib import Path


def read_corpus(folder: Path, reader: str) -> dict[str, bytes]:
    """Name -> content of the seeds of one reader."""
    return {path.name: path.read_bytes() for path in sorted((folder / reader).iterdir())}
