"""The header of a NIfTI-1 file (Cox et al., "A (sort of) new image data format standard: NIfTI-1", 2004)."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from ..ground.checks import InputError
from .stored_volume import StoredVolume, beside, header_error

SIZE = 348
# data type code: bytes of a value; no complex numbers, colours or long doubles
TYPES = {2: 1, 4: 2, 8: 4, 16: 4, 64: 8, 256: 1, 512: 2, 768: 4, 1024: 8, 1280: 8}


def read_nifti(path: Path) -> StoredVolume:
    """What a .nii, .nii.gz, .hdr or .img declares; InputError unless every number in its header makes sense."""
    name = path.name.lower()
    pair = name.endswith((".hdr", ".img", ".img.gz"))
    header = path
    if pair:
        stem = path.name[: name.rindex(".img" if ".img" in name else ".hdr")]
        header = beside(path, f"{stem}.hdr")
    packed, head = _head(header)
    if len(head) < SIZE:
        raise InputError(f"{path}: damaged or truncated, too short for a NIfTI header; copy the file again")
    order = next((o for o in "<>" if struct.unpack_from(f"{o}i", head)[0] == SIZE), "")
    magic = head[344:348]
    if not order or magic != (b"ni1\0" if pair else b"n+1\0"):
        raise header_error(path, "not NIfTI-1")
    sizes, value_bytes, offset = _declared(path, head, order)
    if offset < (0 if pair else SIZE + 4) or offset % 1 or offset > 1e9:
        raise header_error(path, f"voxels begin at byte {offset:g}")
    file = _image_of(path) if pair else path
    packed = file.name.lower().endswith(".gz") if pair else packed
    return StoredVolume(sizes, 1, value_bytes, file, int(offset), "gzip" if packed else "", whole=packed)


def _head(path: Path) -> tuple[bool, bytes]:
    """Whether the file is packed, and its first bytes, unpacked."""
    with path.open("rb") as file:
        head = file.read(4096)
    if not path.name.lower().endswith(".gz") or head[:2] != b"\x1f\x8b":
        return False, head[:SIZE]
    try:
        return True, zlib.decompressobj(31).decompress(head, SIZE)
    except zlib.error:
        return True, b""


def _declared(path: Path, head: bytes, order: str) -> tuple[tuple[int, ...], int, float]:
    """Sizes of all axes, bytes of a value, and where the voxels begin."""
    dimension, *sizes = struct.unpack_from(f"{order}8h", head, 40)
    kind, bits = struct.unpack_from(f"{order}2h", head, 70)
    if not 3 <= dimension <= 5 or min(sizes[:dimension]) < 1:
        raise InputError(
            f"{path}: expected a 3-dimensional label map, got size {sizes[: max(dimension, 0)]}; export a 3D volume"
        )
    if kind not in TYPES or bits != 8 * TYPES[kind]:
        raise InputError(f"{path}: data type {kind} of {bits} bits is no label type; save the labels as integers")
    pixdim = np.array(struct.unpack_from(f"{order}8f", head, 76))
    offset, slope, shift = struct.unpack_from(f"{order}3f", head, 108)
    placed = np.array(struct.unpack_from(f"{order}18f", head, 256))  # quaternion, its offset, affine
    if not np.isfinite([*pixdim[:4], offset, *placed]).all():
        raise header_error(path, "a number that is not finite")
    if (slope not in (0, 1) and not np.isnan(slope)) or (shift != 0 and not np.isnan(shift)):
        raise InputError(f"{path}: its values are scaled (scl_slope), so it is an image; give its label map")
    return tuple(sizes[:dimension]), TYPES[kind], offset


def _image_of(path: Path) -> Path:
    """The voxels of a pair, in the same folder, packed or not."""
    stem = path.name[: path.name.lower().rindex(".img" if ".img" in path.name.lower() else ".hdr")]
    if path.with_name(f"{stem}.img").is_file():
        return beside(path, f"{stem}.img")
    return beside(path, f"{stem}.img.gz")
