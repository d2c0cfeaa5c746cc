"""The text header of a NRRD file (Kindlmann, "Definition of NRRD File Format", teem.sourceforge.net/nrrd)."""

from __future__ import annotations

import re
from pathlib import Path

from ..ground.checks import InputError
from .stored_volume import MAX_HEADER_BYTES, StoredVolume, beside, header_error

_C_TYPES = {
    1: "signed char|int8|int8_t|uchar|unsigned char|uint8|uint8_t",
    2: "short|short int|signed short|signed short int|int16|int16_t|ushort|unsigned short|unsigned short int|uint16"
    "|uint16_t",
    4: "int|signed int|int32|int32_t|uint|unsigned int|uint32|uint32_t|float",
    8: "longlong|long long|long long int|signed long long|signed long long int|int64|int64_t|ulonglong"
    "|unsigned long long|unsigned long long int|uint64|uint64_t|double",
}
TYPES = {name: size for size, names in _C_TYPES.items() for name in names.split("|")}
_NUMBER = r"[-+]?(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,3})?"
_VECTOR = rf"(?:none|\( ?{_NUMBER}(?: ?, ?{_NUMBER}){{1,3}} ?\))"
_NUMBERS = rf"(?:{_NUMBER}|nan|NaN)(?: +(?:{_NUMBER}|nan|NaN)){{0,7}}"
_WORDS = r"[\x20-\x7e]{0,200}"
FIELDS = {  # what teem may see of each field; anything else is refused
    "dimension": r"\d",
    "type": "|".join(map(re.escape, TYPES)),
    "sizes": r"\d{1,10}(?: +\d{1,10}){0,7}",
    "encoding": "raw|gzip|gz",
    "endian": "little|big",
    "space": r"[A-Za-z0-9-]{1,60}",
    "space dimension": r"\d",
    "space directions": rf"{_VECTOR}(?: +{_VECTOR}){{0,7}}",
    "space origin": _VECTOR,
    "measurement frame": rf"{_VECTOR}(?: +{_VECTOR}){{0,7}}",
    **dict.fromkeys(("spacings", "thicknesses", "axis mins", "axismins", "axis maxs", "axismaxs"), _NUMBERS),
    **dict.fromkeys(("min", "max", "old min", "oldmin", "old max", "oldmax"), _NUMBER),
    **dict.fromkeys(("kinds", "centers", "centerings", "labels", "units", "space units", "content"), _WORDS),
    **dict.fromkeys(("sample units", "number"), _WORDS),
    **dict.fromkeys(("line skip", "lineskip", "byte skip", "byteskip"), "0"),
    **dict.fromkeys(("data file", "datafile"), r"[^\0]{1,200}"),
}


def read_nrrd(path: Path) -> StoredVolume:
    """What a .nrrd or .nhdr declares; InputError for fields that are unknown, twice, or not as the format has them."""
    with path.open("rb") as stream:
        head = stream.read(MAX_HEADER_BYTES)
    if not re.match(rb"NRRD000[1-5]\r?\n", head):
        raise header_error(path, "its first line is not that of a NRRD file")
    end = re.search(rb"\n\r?\n", head)
    fields = _fields(path, (head[: end.start()] if end else head).decode("utf-8", errors="replace"))
    missing = [name for name in ("dimension", "type", "sizes", "encoding") if name not in fields]
    if missing:
        raise header_error(path, f"no {missing[0]}")
    sizes = tuple(map(int, fields["sizes"].split()))
    if int(fields["dimension"]) != len(sizes) or not 3 <= len(sizes) <= 4 or min(sizes) < 1:
        raise InputError(f"{path}: expected a 3-dimensional label map, got size {list(sizes)}; export a 3D volume")
    if TYPES[fields["type"]] > 1 and "endian" not in fields:
        raise header_error(path, "no endian")
    detached = fields.get("data file") or fields.get("datafile")
    if detached is None and end is None:
        raise InputError(f"{path}: damaged or truncated, no voxels below the header; copy the file again")
    if detached is not None and not path.name.lower().endswith(".nhdr"):
        raise header_error(path, "the voxels are in another file, which only a .nhdr may name")
    file = path if detached is None else beside(path, detached)
    offset = end.end() if detached is None and end else 0
    return StoredVolume(sizes, 1, TYPES[fields["type"]], file, offset, "" if fields["encoding"] == "raw" else "gzip")


def _fields(path: Path, text: str) -> dict[str, str]:
    """The fields of the format; key:=value pairs are only checked for what could not be shown."""
    fields: dict[str, str] = {}
    keys: set[str] = set()
    for line in text.split("\n")[1:]:
        line = line.rstrip("\r")
        if line.startswith("#") or not line:
            continue
        key, mark, value = line.partition(":=")
        if mark and re.fullmatch(r"[^:]{1,200}", key):
            if key in keys or not key.isprintable() or "\ufffd" in key or "\0" in line or len(line) > 100_000:
                raise header_error(path, f"key {key[:60]!r} is twice there, too long or no text")
            keys.add(key)
            continue
        name, _, value = line.partition(":")
        name, value = name.strip().lower(), value.strip()
        if name not in FIELDS or not re.fullmatch(FIELDS[name], value) or name in fields:
            raise header_error(path, f"line {line[:60]!r} is not understood")
        fields[name] = value
    return fields
