"""Small files that the reader tests write: label maps on any grid, splats in any PLY dialect."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import SimpleITK as sitk

LPS = np.array([-1.0, -1.0, 1.0])


def write_labels(
    path: Path, labels: np.ndarray, *, affine: np.ndarray | None = None, metadata=None, vector=False
) -> Path:
    """Writes labels[i, j, k] with a RAS affine (4, 4) (default 1 mm); metadata: extra NRRD keys."""
    affine = np.eye(4) if affine is None else affine
    order = (2, 1, 0, 3) if vector else (2, 1, 0)
    image = sitk.GetImageFromArray(np.ascontiguousarray(labels.transpose(order)), isVector=vector)
    step = affine[:3, :3] * LPS[:, None]
    spacing = np.linalg.norm(step, axis=0)
    image.SetSpacing(spacing.tolist())
    image.SetDirection((step / spacing).ravel().tolist())
    image.SetOrigin((affine[:3, 3] * LPS).tolist())
    for key, value in (metadata or {}).items():
        image.SetMetaData(key, str(value))
    sitk.WriteImage(image, str(path), useCompression=True)
    return path


def blob(shape=(24, 30, 20), spacing=(1.0, 1.0, 1.0)) -> np.ndarray:
    """An organ-like boolean mask without any symmetry: two overlapping ellipsoids well inside the grid."""
    axes = [np.arange(n) * s for n, s in zip(shape, spacing, strict=True)]
    x, y, z = np.meshgrid(*[a - a.mean() for a in axes], indexing="ij")
    half = [a.max() / 2 for a in axes]
    first = (x / (0.6 * half[0])) ** 2 + (y / (0.7 * half[1])) ** 2 + (z / (0.6 * half[2])) ** 2 < 1
    second = ((x - 0.3 * half[0]) ** 2 + (y + 0.4 * half[1]) ** 2 + (z - 0.2 * half[2]) ** 2) < (0.45 * min(half)) ** 2
    return first | second


PLY_NAME = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int", "u4": "uint"}
PLY_FORMAT = {"<": "binary_little_endian", ">": "binary_big_endian", "a": "ascii"}


def ply_bytes(elements: dict[str, dict[str, np.ndarray]], order: str = "<", comments=()) -> bytes:
    """A PLY file of scalar columns; order: '<', '>' or 'a' for ASCII."""
    lines = ["ply", f"format {PLY_FORMAT[order]} 1.0", *[f"comment {c}" for c in comments]]
    body = b""
    for name, columns in elements.items():
        count = len(next(iter(columns.values())))
        lines.append(f"element {name} {count}")
        lines += [f"property {PLY_NAME[c.dtype.str[1:]]} {n}" for n, c in columns.items()]
        if order == "a":
            rows = zip(*[c.tolist() for c in columns.values()], strict=True)
            body += "".join(" ".join(repr(v) for v in row) + "\n" for row in rows).encode()
        else:
            table = np.empty(count, dtype=[(n, order + c.dtype.str[1:]) for n, c in columns.items()])
            for n, c in columns.items():
                table[n] = c
            body += table.tobytes()
    return ("\n".join([*lines, "end_header"]) + "\n").encode() + body


def splat_columns(count=50, *, degree=0, normals=True, scales=3, dtype="f4", seed=0) -> dict[str, np.ndarray]:
    """INRIA-layout columns with random numbers."""
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals else []) + ["f_dc_0", "f_dc_1", "f_dc_2"]
    names += [f"f_rest_{i}" for i in range(3 * ((degree + 1) ** 2 - 1))] + ["opacity"]
    names += [f"scale_{i}" for i in range(scales)] + [f"rot_{i}" for i in range(4)]
    rng = np.random.default_rng(seed)
    return {name: rng.normal(size=count).astype(dtype) for name in names}
