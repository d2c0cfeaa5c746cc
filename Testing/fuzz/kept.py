"""Inputs as libFuzzer keeps them: one byte for the name, which is one of the seeds' names, then the content."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from corpus import read_corpus


def packed(name: str, content: bytes, names: Sequence[str]) -> bytes:
    """``names``: of all seeds, sorted."""
    return bytes([names.index(name)]) + content


def unpacked(data: bytes, names: Sequence[str]) -> tuple[str, bytes]:
    """Name and content; any bytes are some input."""
    return names[data[0] % len(names) if data else 0], data[1:]


def keep_seeds(corpus: Path, reader: str, folder: Path) -> None:
    """The seeds of a reader in libFuzzer's folder, where they are not yet."""
    folder.mkdir(parents=True, exist_ok=True)
    seeds = read_corpus(corpus, reader)
    for name, content in seeds.items():
        (folder / f"seed_{name}").write_bytes(packed(name, content, sorted(seeds)))


def kept_inputs(corpus: Path, reader: str, folder: Path) -> list[tuple[str, bytes]]:
    """Name and content of all that is kept, the seeds among them."""
    names = sorted(read_corpus(corpus, reader))
    return [unpacked(path.read_bytes(), names) for path in sorted(folder.iterdir())]
