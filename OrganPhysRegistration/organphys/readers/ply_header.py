"""The header of a PLY file, read and checked against the file's size before any library allocates for it."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..ground.checks import InputError

MAX_HEADER_BYTES = 1_000_000
MAX_PROPERTIES = 1000
WORDS = 5  # told apart in a line; the rest of it stays one
FORMATS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    old_or_new: kind
    for names, kind in (
        ("char int8", "i1"),
        ("uchar uint8", "u1"),
        ("short int16", "i2"),
        ("ushort uint16", "u2"),
        ("int int32", "i4"),
        ("uint uint32", "u4"),
        ("float float32", "f4"),
        ("double float64", "f8"),
    )
    for old_or_new in names.split()
}


@dataclass(frozen=True)
class PlyElement:
    """One element: its rows, and per property the name and numpy type; ``lists``: it has list properties."""

    name: str
    count: int
    properties: tuple[tuple[str, str], ...]
    lists: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(name for name, _ in self.properties)

    @property
    def row_bytes(self) -> int:
        return sum(np.dtype(kind).itemsize for _, kind in self.properties)


@dataclass(frozen=True)
class PlyHeader:
    """Format, elements in file order and comments."""

    path: Path
    format: str
    elements: tuple[PlyElement, ...]
    comments: tuple[str, ...]
    size: int

    def element(self, name: str) -> PlyElement | None:
        return next((e for e in self.elements if e.name == name), None)


def read_ply_header(path: str | Path) -> PlyHeader:
    """Header of a PLY file; InputError where it is no PLY, damaged, or the file is shorter than it declares."""
    path = Path(path)
    if os.path.isdir(path):
        raise InputError(f"{path}: this is a folder; name the splat in it (.ply)")
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file; give a splat (.ply)")
    try:
        with path.open("rb") as file:
            head = file.read(MAX_HEADER_BYTES)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check its permissions") from error
    if not head:
        raise InputError(f"{path}: the file is empty; copy or export the splat again")
    if not head.startswith((b"ply\n", b"ply\r\n")):
        raise InputError(f"{path}: not a PLY file, its first line is not 'ply'; export the splat as PLY")
    end = head.find(b"\nend_header") + 1
    if end == 0:
        raise InputError(f"{path}: the PLY header does not end within the first megabyte; the file is damaged or cut")
    newline = head.find(b"\n", end)
    size = newline + 1 if newline >= 0 else len(head)
    header = _parse(path, head[:end].split(b"\n"), size)
    _check_size(header)
    return header


def _parse(path: Path, lines: list[bytes], size: int) -> PlyHeader:
    """Lines end at LF alone and words at the white space of ASCII: Python's texts know more of both."""
    kind, comments, elements = "", [], []
    for raw in lines[1:]:
        words = [word.decode("ascii", errors="replace") for word in raw.split(maxsplit=WORDS)]
        line = raw.decode("ascii", errors="replace").strip()
        match words:
            case ["format", value, *_] if not kind:
                kind = value
            case ["comment" | "obj_info", *_]:
                comments.append(line.split(maxsplit=1)[1] if len(words) > 1 else "")
            case ["element", name, count] if re.fullmatch("[0-9]{1,15}", count):
                elements.append(PlyElement(name, int(count), ()))
            case ["property", *rest] if elements:
                elements[-1] = _with_property(path, elements[-1], rest)
            case []:
                continue
            case _:
                raise InputError(f"{path}: PLY header line {line.strip()[:80]!r} is not understood; export it again")
    if kind not in FORMATS:
        raise InputError(f"{path}: unknown PLY format {kind[:40]!r}; use ascii or binary_little_endian")
    if len({element.name for element in elements}) < len(elements):
        raise InputError(f"{path}: several elements of one name in the PLY file; export the splat again")
    return PlyHeader(path, kind, tuple(elements), tuple(comments), size)


def _with_property(path: Path, element: PlyElement, words: list[str]) -> PlyElement:
    if len(words) == 4 and words[0] == "list":
        return PlyElement(element.name, element.count, element.properties, lists=True)
    if len(words) != 2 or words[0] not in TYPES:
        raise InputError(f"{path}: PLY property {' '.join(words)[:80]!r} is not understood; the file is damaged")
    if len(element.properties) >= MAX_PROPERTIES:
        raise InputError(f"{path}: more than {MAX_PROPERTIES} properties, so this is no splat; export it again")
    if words[1] in element.names:
        raise InputError(
            f"{path}: PLY property {words[1][:40]!r} occurs twice in {element.name[:40]!r}; export the splat again"
        )
    return PlyElement(element.name, element.count, (*element.properties, (words[1], TYPES[words[0]])), element.lists)


def _check_size(header: PlyHeader) -> None:
    """A scalar takes its type's bytes, or in ASCII at least a digit and a separator."""
    least = 0
    for element in header.elements:
        row = 2 * len(element.properties) if header.format == "ascii" else element.row_bytes
        least += element.count * (row + element.lists)
    held = os.path.getsize(header.path) - header.size + (header.format == "ascii")
    if held < least:
        raise InputError(
            f"{header.path}: truncated, its header declares at least {least} bytes of data but {held} are there; "
            "copy or export the file again"
        )
