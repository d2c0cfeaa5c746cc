"""Seeds cut from the files of case folders, where there are any: their own headers, with few rows and few voxels."""

from __future__ import annotations

import gzip
import struct
from pathlib import Path

import numpy as np

ROWS, STEP = 12, 16


def case_seeds(folder: Path) -> dict[str, dict[str, bytes]]:
    """Reader -> name -> content, of every case in ``folder``; empty where there is none."""
    out: dict[str, dict[str, bytes]] = {name: {} for name in ("splat", "labels", "landmarks", "region")}
    for case in sorted(path.parent for path in folder.glob("*/splat.ply")):
        out["splat"][f"{case.name}.ply"] = first_rows((case / "splat.ply").read_bytes())
        out["labels"][f"{case.name}.nii.gz"] = thinned((case / "ct_labels.nii.gz").read_bytes())
        for reader, file in (("landmarks", "landmarks.mrk.json"), ("region", "case.json")):
            text = (case / file).read_bytes()
            if reader == "landmarks" or b'"roi": {' in text:
                out[reader][f"{case.name}.{file}"] = text
    return out


def first_rows(ply: bytes) -> bytes:
    """The header and the first rows of a binary PLY of floats."""
    head, mark, body = ply.partition(b"end_header\n")
    lines = head.split(b"\n")
    row = 4 * sum(line.startswith(b"property float ") for line in lines)
    lines = [b"element vertex %d" % ROWS if line.startswith(b"element vertex ") else line for line in lines]
    return b"\n".join(lines) + mark + body[: ROWS * row]


def thinned(packed: bytes) -> bytes:
    """A NIfTI label map of bytes with every 16th voxel of each axis, its affine stretched as much."""
    content = gzip.decompress(packed)
    sizes = struct.unpack_from("<3h", content, 42)
    voxels = np.frombuffer(content, "u1", int(np.prod(sizes)), 352).reshape(sizes, order="F")[::STEP, ::STEP, ::STEP]
    head = bytearray(content[:352])
    struct.pack_into("<3h", head, 42, *voxels.shape)
    struct.pack_into("<3f", head, 80, *np.multiply(struct.unpack_from("<3f", content, 80), STEP))
    affine = np.reshape(struct.unpack_from("<12f", content, 280), (3, 4)) * (STEP, STEP, STEP, 1)
    struct.pack_into("<12f", head, 280, *affine.ravel())
    return gzip.compress(bytes(head) + voxels.tobytes(order="F"), mtime=0)
