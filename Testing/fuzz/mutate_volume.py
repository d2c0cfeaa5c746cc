"""Mutations of label maps: the fields of their headers, and their voxels, which are packed again or cut short."""

from __future__ import annotations

import gzip
import struct
import zlib

from mutate_bytes import Rng, mutate_bytes, pick
from mutate_lines import mutate_lines

NIFTI_FIELDS = {  # offset, format, how many of them
    "sizeof_hdr": (0, "i", 1),
    "dim": (40, "h", 8),
    "datatype": (70, "h", 2),
    "pixdim": (76, "f", 8),
    "vox_offset": (108, "f", 1),
    "scaling": (112, "f", 2),
    "xyzt_units": (123, "b", 1),
    "codes": (252, "h", 2),
    "quaternion": (256, "f", 6),
    "affine": (280, "f", 12),
    "magic": (344, "i", 1),
    "extension": (348, "i", 1),
    "extension_size": (352, "i", 2),
}
WHOLE = (0, 1, -1, 2, 3, 4, 5, 7, 8, 16, 64, 100, 127, 128, 255, 256, 512, 768, 1024, 2304, 32767, -32768)
BOMB_BYTES = 40_000_000


def mutate_nifti(content: bytes, rng: Rng) -> bytes:
    """A NIfTI file (inflated) with hostile header fields or damaged voxels."""
    kind = rng.random()
    if kind < 0.65 and len(content) >= 360:
        out = bytearray(content)
        for _ in range(1 + int(rng.random() < 0.4)):
            _hostile_field(out, rng)
        return bytes(out)
    if kind < 0.75:
        return content[:352] + mutate_bytes(content[352:], rng)
    return mutate_bytes(content, rng)


def _hostile_field(out: bytearray, rng: Rng) -> None:
    offset, kind, count = pick(rng, tuple(NIFTI_FIELDS.values()))
    size = struct.calcsize(kind)
    at = offset + size * int(rng.integers(count))
    order = ">" if out[:4] == b"\x00\x00\x01\x5c" else "<"
    if kind == "f":
        value: float = pick(rng, (0.0, -1.0, 1e-30, 1e30, 3e38, float("nan"), float("inf"), 352.0, 1e9, 353.5, -352.0))
        out[at : at + size] = struct.pack(order + kind, value)
        return
    number = pick(rng, WHOLE) if rng.random() < 0.8 else int(rng.integers(-(2**31), 2**31))
    out[at : at + size] = (number % 256**size).to_bytes(size, "big" if order == ">" else "little")


def mutate_packed_nifti(content: bytes, rng: Rng) -> bytes:
    """A .nii.gz: its content mutated and packed again, or the packed stream damaged."""
    if rng.random() < 0.25:
        return mutate_bytes(content, rng)
    inner = mutate_nifti(gzip.decompress(content), rng)
    return _packed(inner, rng, gzip_form=True)


def mutate_text_volume(content: bytes, rng: Rng) -> bytes:
    """NRRD or MetaImage: a text header and then voxels, raw or packed."""
    head, data = split_header(content)
    kind = rng.random()
    if kind < 0.7 or not data:
        return mutate_lines(head, rng) + data
    if kind < 0.85:
        return head + mutate_bytes(data, rng)
    gzip_form = data[:2] == b"\x1f\x8b"
    try:
        inner = zlib.decompress(data, 47)
    except zlib.error:
        return mutate_bytes(content, rng)
    return head + _packed(mutate_bytes(inner, rng), rng, gzip_form=gzip_form)


def split_header(content: bytes) -> tuple[bytes, bytes]:
    """Text header and what follows it."""
    at = content.find(b"\n\n")
    if content.startswith(b"NRRD") and at >= 0:
        return content[: at + 2], content[at + 2 :]
    at = content.find(b"ElementDataFile")
    end = content.find(b"\n", at) + 1
    return (content[:end], content[end:]) if at >= 0 and end > 0 else (content, b"")


def _packed(inner: bytes, rng: Rng, *, gzip_form: bool) -> bytes:
    if rng.random() < 0.004:  # holds far more than it declares
        inner += bytes(BOMB_BYTES)
    maker = zlib.compressobj(6, zlib.DEFLATED, 31 if gzip_form else 15)
    out = maker.compress(inner) + maker.flush()
    kind = rng.random()
    if kind < 0.1:
        return out[: int(rng.integers(len(out)))]
    if kind < 0.15:
        return out + out
    if kind < 0.2:
        return out[:-8] + rng.bytes(8)
    return out
