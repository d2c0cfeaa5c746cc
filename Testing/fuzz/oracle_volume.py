"""What the labels of a file must be, told by a second, plain reading of the same bytes."""

from __future__ import annotations

import re
import struct
import zlib

import numpy as np

from organphys.readers.segmentation_file import SegmentationInfo

VOXELS = bytes([0, 1, 1, 2]) * 160  # what the detached headers of the corpus name
NIFTI = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4", 1024: "i8", 1280: "u8"}
NRRD = {
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("signed char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("short", "short int", "signed short", "signed short int", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "signed int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    **dict.fromkeys(("longlong", "long long", "long long int", "int64", "int64_t"), "i8"),
    **dict.fromkeys(("ulonglong", "unsigned long long", "uint64", "uint64_t"), "u8"),
    "float": "f4", "double": "f8",
}  # fmt: skip
META = {
    "MET_UCHAR": "u1", "MET_CHAR": "i1", "MET_SHORT": "i2", "MET_USHORT": "u2", "MET_INT": "i4", "MET_UINT": "u4",
    "MET_LONG_LONG": "i8", "MET_ULONG_LONG": "u8", "MET_FLOAT": "f4", "MET_DOUBLE": "f8",
}  # fmt: skip


def labels_problem(name: str, content: bytes, info: SegmentationInfo) -> str | None:
    """Why the description is no true account of the file; None if it is one."""
    if min(info.shape) < 1 or not all(np.isfinite(s) and s > 0 for s in info.spacing_mm):
        return f"shape {info.shape} or spacing {info.spacing_mm}"
    voxels = plain_voxels(name, content)
    if voxels.size != int(np.prod(info.shape)) * info.layers:
        return f"{voxels.size} voxels in the file, shape {info.shape} with {info.layers} layers"
    labels, counts = np.unique(voxels[voxels != 0], return_counts=True)
    found: dict[int, int] = {}
    for label in info.labels:
        found[label.label] = found.get(label.label, 0) + label.voxels
        if label.name is not None:
            label.name.encode("utf-8")
    if found != {int(k): int(n) for k, n in zip(labels, counts, strict=True)}:
        return f"labels {found}, a plain reading has {dict(zip(labels.tolist(), counts.tolist(), strict=True))}"
    return None


def plain_voxels(name: str, content: bytes) -> np.ndarray:
    """All voxels (N,) of the file's own type."""
    if name.endswith((".nii", ".nii.gz")):
        return _nifti(_inflated(content) if content[:2] == b"\x1f\x8b" else content)
    detached = name.endswith((".nhdr", ".mhd"))
    return (_nrrd if name.endswith((".nrrd", ".nhdr")) else _meta)(content, VOXELS if detached else None)


def _nifti(content: bytes) -> np.ndarray:
    order = "<" if struct.unpack_from("<i", content)[0] == 348 else ">"
    dim = struct.unpack_from(order + "8h", content, 40)
    kind = struct.unpack_from(order + "h", content, 70)[0]
    offset, slope, shift = struct.unpack_from(order + "3f", content, 108)
    count = int(np.prod(dim[1 : dim[0] + 1], dtype=np.int64))
    voxels = np.frombuffer(content, order + NIFTI[kind], count, max(int(offset), 352))
    if voxels.dtype.kind == "f":  # the format's library takes what is not finite for background
        voxels = np.where(np.isfinite(voxels), voxels, 0)
    scaled = np.nan_to_num(slope) not in (0, 1) or np.nan_to_num(shift) != 0
    return voxels * np.float64(slope) + np.nan_to_num(shift) if scaled else voxels


def _inflated(content: bytes) -> bytes:
    """All gzip members, without what follows them."""
    out = b""
    while content[:2] == b"\x1f\x8b":
        stream = zlib.decompressobj(31)
        out += stream.decompress(content)
        content = stream.unused_data
    return out


def _nrrd(content: bytes, voxels: bytes | None) -> np.ndarray:
    head, *rest = re.split(rb"\n\r?\n", content, maxsplit=1)
    pairs = re.findall(r"(?m)^([A-Za-z ]+):(?!=)[ \t]*(.*)$", head.replace(b"\r", b"").decode("latin-1"))
    fields = {name.strip().lower(): value for name, value in pairs}
    data = rest[0] if voxels is None or "data file" not in fields else voxels
    order = "<" if fields.get("endian", "little").strip() == "little" else ">"
    if fields["encoding"].strip() in ("gzip", "gz"):
        data = _inflated(data)
    count = int(np.prod([int(n) for n in fields["sizes"].split()], dtype=np.int64))
    return np.frombuffer(data, order + NRRD[fields["type"].strip()], count)


def _meta(content: bytes, voxels: bytes | None) -> np.ndarray:
    last = re.search(rb"(?m)^[ \t]*ElementDataFile[ \t]*=[^\n]*\n?", content)
    end = len(content) if last is None else last.end()
    pairs = re.findall(r"(?m)^[ \t]*(\w+)[ \t]*=[ \t]*(.*?)[ \t\r]*$", content[:end].decode("latin-1"))
    fields = dict(pairs)
    data = content[end:] if voxels is None or fields["ElementDataFile"].upper() == "LOCAL" else voxels
    if fields.get("CompressedData", "False")[0] in "tT1":
        data = zlib.decompressobj().decompress(data)
    most_first = fields.get("BinaryDataByteOrderMSB") or fields.get("ElementByteOrderMSB") or "False"
    order = ">" if most_first[0] in "tT1" else "<"
    count = int(np.prod([int(n) for n in fields["DimSize"].split()], dtype=np.int64))
    channels = int(fields.get("ElementNumberOfChannels", "1"))
    return np.frombuffer(data, order + META[fields["ElementType"]], count * channels)
