"""The text header of a MetaImage file (ITK wiki, "ITK/MetaIO/Documentation")."""

from __future__ import annotations

import re
from pathlib import Path

from ..ground.checks import InputError
from .stored_volume import MAX_HEADER_BYTES, StoredVolume, beside, header_error

TYPES = {
    "MET_CHAR": 1, "MET_UCHAR": 1, "MET_SHORT": 2, "MET_USHORT": 2, "MET_INT": 4, "MET_UINT": 4, "MET_FLOAT": 4,
    "MET_LONG_LONG": 8, "MET_ULONG_LONG": 8, "MET_DOUBLE": 8,
}  # fmt: skip
_NUMBER = r"[-+]?(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,3})?"
_NUMBERS = rf"{_NUMBER}(?:\s+{_NUMBER}){{0,15}}"
_TRUTH = r"(?i:true|false|t|f|1|0)"
FIELDS = {
    "ObjectType": "Image",
    "NDims": "[34]",
    "DimSize": r"\d{1,10}(?:\s+\d{1,10}){2,3}",
    "BinaryData": r"(?i:true|t|1)",
    **dict.fromkeys(("BinaryDataByteOrderMSB", "ElementByteOrderMSB", "CompressedData"), _TRUTH),
    "CompressedDataSize": r"\d{1,15}",
    "ElementType": "|".join(TYPES),
    "ElementNumberOfChannels": r"\d{1,4}",
    "HeaderSize": "0",
    **dict.fromkeys(("Offset", "Origin", "Position", "CenterOfRotation"), _NUMBERS),
    **dict.fromkeys(("TransformMatrix", "Orientation", "Rotation", "ElementSpacing", "ElementSize"), _NUMBERS),
    "AnatomicalOrientation": "[A-Z?]{1,8}",
    "ElementDataFile": r"[^\0]{1,200}",
}
COUNTS = {  # how many numbers: by the number of axes
    **dict.fromkeys(
        ("DimSize", "Offset", "Origin", "Position", "CenterOfRotation", "ElementSpacing", "ElementSize"), 1
    ),
    **dict.fromkeys(("TransformMatrix", "Orientation", "Rotation"), 2),
}


def read_metaimage(path: Path) -> StoredVolume:
    """What a .mha or .mhd declares; InputError for fields that are twice there or not as the format has them."""
    with path.open("rb") as stream:
        head = stream.read(MAX_HEADER_BYTES)
    last = re.search(rb"(?:\A|\n)ElementDataFile *= *([^\r\n]*)\r?\n?", head)
    if last is None:
        raise header_error(path, "no ElementDataFile")
    fields = _fields(path, head[: last.end()].decode("utf-8", errors="replace"))
    missing = [name for name in ("NDims", "DimSize", "ElementType") if name not in fields]
    if missing:
        raise header_error(path, f"no {missing[0]}")
    axes = int(fields["NDims"])
    for name, power in COUNTS.items():
        if name in fields and len(fields[name].split()) != axes**power:
            raise header_error(path, f"{name} does not hold {axes**power} numbers")
    local = fields["ElementDataFile"].upper() == "LOCAL"
    if not local and not path.name.lower().endswith(".mhd"):
        raise header_error(path, "the voxels are in another file, which only a .mhd may name")
    file = path if local else beside(path, fields["ElementDataFile"])
    offset = last.end() if local else 0
    packed = fields.get("CompressedData", "False")[0] in "tT1"
    stated = int(fields["CompressedDataSize"]) if "CompressedDataSize" in fields else None
    if packed and stated is not None and stated > file.stat().st_size - offset:
        raise InputError(f"{path}: damaged or truncated, {stated} bytes of packed voxels declared; copy the file again")
    sizes = tuple(map(int, fields["DimSize"].split()))
    if min(sizes) < 1:
        raise InputError(f"{path}: expected a 3-dimensional label map, got size {list(sizes)}; export a 3D volume")
    channels = int(fields.get("ElementNumberOfChannels", 1))
    packing = "zlib" if packed else ""
    return StoredVolume(sizes, channels, TYPES[fields["ElementType"]], file, offset, packing, packed_bytes=stated)


def _fields(path: Path, text: str) -> dict[str, str]:
    """Fields by name; those that are not the format's own are only checked for what could not be shown."""
    fields: dict[str, str] = {}
    for line in text.replace("\r\n", "\n").split("\n"):
        if not line.strip():
            continue
        name, mark, value = (part.strip() for part in line.partition("="))
        pattern = FIELDS.get(name, r"[^\0]{0,2000}")
        if (
            not mark
            or not re.fullmatch(r"[\w .:()@-]{1,100}", name)
            or name in fields
            or not re.fullmatch(pattern, value)
        ):
            raise header_error(path, f"line {line[:60]!r} is not understood")
        fields[name] = value
    return fields
