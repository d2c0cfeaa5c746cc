"""Seed splats: the first Gaussians of the sample case in every PLY dialect."""

from __future__ import annotations

import numpy as np
from plyfile import PlyData
from reader_samples import ply_bytes, splat_columns

from organphys.pipeline.sample_case import SampleCase
from organphys.readers.supersplat_ply import COLOUR_BOUNDS, POSITION_BOUNDS, SCALE_BOUNDS

ROWS = 12


def splat_seeds(case: SampleCase) -> dict[str, bytes]:
    """Name -> content."""
    vertex = PlyData.read(str(case.splat))["vertex"].data[:ROWS]
    inria = {name: np.ascontiguousarray(vertex[name]) for name in vertex.dtype.names}
    xyz = {name: inria[name] for name in "xyz"}
    octets = {name: np.arange(ROWS, dtype="u1") * 20 for name in ("red", "green", "blue")}
    floats = {name: np.linspace(0, 1, ROWS).astype("f4") for name in ("red", "green", "blue")}
    wide = {name: values.astype("f8") for name, values in inria.items()}
    faces = {"vertex_a": np.arange(3, dtype="i4"), "vertex_b": np.arange(3, dtype="i4")}
    return {
        "inria_little.ply": ply_bytes({"vertex": inria}, comments=("made by a test",)),
        "inria_big.ply": ply_bytes({"vertex": inria}, ">"),
        "inria_ascii.ply": ply_bytes({"vertex": inria}, "a"),
        "doubles.ply": ply_bytes({"vertex": wide}),
        "degree_3.ply": ply_bytes({"vertex": splat_columns(5, degree=3)}),
        "two_scales.ply": ply_bytes({"vertex": splat_columns(8, scales=2, normals=False)}),
        "points_ascii.ply": ply_bytes({"vertex": xyz | octets}, "a"),
        "points_octets.ply": ply_bytes({"vertex": xyz | octets}),
        "points_floats.ply": ply_bytes({"vertex": xyz | floats, "edge": faces}),
        "mesh_ascii.ply": with_faces(ply_bytes({"vertex": xyz}, "a"), b"3 0 1 2\n3 1 2 3\n"),
        "mesh_binary.ply": with_faces(ply_bytes({"vertex": xyz}), (b"\x03" + np.arange(3, dtype="<i4").tobytes()) * 2),
        "compressed.ply": compressed(xyz, colours=True),
        "compressed_sh.ply": compressed(xyz, colours=False, rest=9),
    }


def with_faces(content: bytes, rows: bytes) -> bytes:
    """The mesh that most programs write: vertices, then faces as lists."""
    lists = b"element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    return content.replace(b"end_header\n", lists) + rows


def compressed(xyz: dict[str, np.ndarray], *, colours: bool, rest: int = 0) -> bytes:
    """SuperSplat's layout with one chunk."""
    rng = np.random.default_rng(0)
    chunk: dict[str, np.ndarray] = {}
    for bounds in (POSITION_BOUNDS, SCALE_BOUNDS) + ((COLOUR_BOUNDS,) if colours else ()):
        for name in bounds[0] + bounds[1]:
            chunk[name] = np.array([-1.0 if name.startswith("min") else 1.0], dtype="f4")
    count = len(xyz["x"])
    packed = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
    elements = {"chunk": chunk, "vertex": {name: rng.integers(0, 2**32, count).astype("u4") for name in packed}}
    if rest:
        elements["sh"] = {f"f_rest_{k}": rng.integers(0, 256, count).astype("u1") for k in range(rest)}
    return ply_bytes(elements)
