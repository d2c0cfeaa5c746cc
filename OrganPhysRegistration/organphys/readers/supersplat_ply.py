"""SuperSplat's (PlayCanvas) compressed PLY: packed integers within the bounds of chunks of 256 Gaussians.

Layout after PlayCanvas' splat-transform (src/compressed-chunk.ts) and engine (gsplat-compressed-data): element chunk
with min/max of x, y, z, scale_x, scale_y, scale_z and, in newer files, r, g, b; element vertex with packed_position and
packed_scale (11-10-11 bits), packed_rotation (index of the largest component of w, x, y, z, then the other three in
10 bits each), packed_color (8-8-8-8; the last is the opacity, already 0..1); optional element sh with bytes f_rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from ..points.gaussians import SH_C0, Gaussians, logit_from_opacity
from ..points.point_sets import GaussianCloud
from .gaussian_fields import non_finite_notices
from .ply_columns import Rows, blocks, stack_columns
from .ply_header import PlyHeader

CHUNK = 256
LARGEST_BOUND = 1e30  # of single precision's 3e38
PACKED = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
POSITION_BOUNDS = (("min_x", "min_y", "min_z"), ("max_x", "max_y", "max_z"))
SCALE_BOUNDS = (("min_scale_x", "min_scale_y", "min_scale_z"), ("max_scale_x", "max_scale_y", "max_scale_z"))
COLOUR_BOUNDS = (("min_r", "min_g", "min_b"), ("max_r", "max_g", "max_b"))

Floats = NDArray[np.float32]
Words = NDArray[np.uint32]


def is_compressed(header: PlyHeader) -> bool:
    """Whether the vertices are packed."""
    vertex = header.element("vertex")
    return vertex is not None and "packed_position" in vertex.names


def check_layout(header: PlyHeader) -> None:
    """InputError unless all elements of the layout are there and fit together."""
    vertex, chunk, sh = header.element("vertex"), header.element("chunk"), header.element("sh")
    bounds = sum((POSITION_BOUNDS + SCALE_BOUNDS), ())
    if vertex is None or chunk is None or not set(PACKED) <= set(vertex.names) or not set(bounds) <= set(chunk.names):
        raise InputError(f"{header.path}: incomplete compressed splat (chunk or packed fields); export it again")
    kinds = {kind for name, kind in vertex.properties if name in PACKED}
    if kinds != {"u4"} or {kind for _, kind in chunk.properties} != {"f4"} or chunk.count < -(-vertex.count // CHUNK):
        raise InputError(f"{header.path}: compressed splat with too few chunks or wrong types; export it again")
    rest = [n for n in sh.names if n.startswith("f_rest_")] if sh else []
    whole = [f"f_rest_{k}" for k in range(len(rest))] == sorted(rest, key=lambda name: (len(name), name))
    octets = sh is None or {kind for _, kind in sh.properties} == {"u1"}
    if sh is not None and (sh.count != vertex.count or len(rest) not in (9, 24, 45) or not whole or not octets):
        raise InputError(f"{header.path}: spherical harmonics do not fit the vertices; export the splat again")


def decode_cloud(rows: dict[str, Rows], *, progress: Progress = no_progress) -> GaussianCloud:
    """Centres, opacities, colours and validity of packed rows."""
    vertex, chunk = rows["vertex"], rows["chunk"]
    centres = np.empty((len(vertex), 3), dtype=np.float32)
    colours = np.empty((len(vertex), 4), dtype=np.float32)
    for part in blocks(len(vertex), progress=progress):
        centres[part] = _within(_unpack_11_10_11(_words(vertex, part, "packed_position")), chunk, part, POSITION_BOUNDS)
        colours[part] = _colours(vertex, chunk, part)
    valid = _finite_chunks(chunk)[np.arange(len(vertex)) // CHUNK]
    notices = non_finite_notices(valid)
    return GaussianCloud(centres, colours[:, 3], np.clip(colours[:, :3], 0, 1), valid, notices)


def decode_gaussians(rows: dict[str, Rows], *, progress: Progress = no_progress) -> Gaussians:
    """Full record of packed rows in the INRIA parametrisation."""
    vertex, chunk = rows["vertex"], rows["chunk"]
    cloud = decode_cloud(rows, progress=progress)
    everything = slice(0, len(vertex))
    scales = _unpack_11_10_11(_words(vertex, everything, "packed_scale"))
    colours = _colours(vertex, chunk, everything)
    return Gaussians(
        means=cloud.centres,
        log_scales=_within(scales, chunk, everything, SCALE_BOUNDS),
        quaternions=_unpack_rotation(_words(vertex, everything, "packed_rotation")),
        opacity_logits=logit_from_opacity(cloud.opacities),
        sh_dc=_sh_dc(colours[:, :3]),
        sh_rest=_sh_rest(rows.get("sh"), len(vertex)),
        valid=cloud.valid,
        extra={n: np.array(vertex[n]) for n in vertex.dtype.names or () if n not in PACKED},
    )


def _words(vertex: Rows, part: slice, name: str) -> Words:
    return vertex[name][part].astype(np.uint32)


def _unpack_11_10_11(words: Words) -> Floats:
    """(N, 3) in 0..1."""
    parts = np.stack([words >> 21, (words >> 11) & 1023, words & 2047], axis=1)
    return parts.astype(np.float32) * np.array([1 / 2047, 1 / 1023, 1 / 2047], dtype=np.float32)


def _colours(vertex: Rows, chunk: Rows, part: slice) -> Floats:
    """Red, green, blue and opacity (N, 4); the colours within their chunk's bounds where the file has them."""
    words = _words(vertex, part, "packed_color")
    octets = np.stack([(words >> shift) & 255 for shift in (24, 16, 8, 0)], axis=1)
    parts: Floats = octets.astype(np.float32) / np.float32(255)
    if set(sum(COLOUR_BOUNDS, ())) <= set(chunk.dtype.names or ()):
        parts[:, :3] = _within(parts[:, :3], chunk, part, COLOUR_BOUNDS)
    return parts


def _within(parts: Floats, chunk: Rows, part: slice, bounds: tuple[tuple[str, ...], tuple[str, ...]]) -> Floats:
    """Fractions (N, 3) as values between the bounds of the Gaussians' chunks."""
    owner = np.arange(part.start, part.stop) // CHUNK
    low, high = (stack_columns(chunk, names).astype(np.float32)[owner] for names in bounds)
    with np.errstate(invalid="ignore"):  # broken bounds are masked by _finite_chunks
        return np.asarray(low * (1 - parts) + high * parts, dtype=np.float32)


def _unpack_rotation(words: Words) -> Floats:
    """Unit quaternions (N, 4) w, x, y, z: the largest component is left out and positive."""
    packed = np.stack([(words >> shift) & 1023 for shift in (20, 10, 0)], axis=1)
    small = (packed / 1023 - 0.5) * np.sqrt(2)
    largest = (words >> 30).astype(np.int64)
    # the other three keep their order round the largest one
    order = np.array([[k for k in range(4) if k != left_out] for left_out in range(4)])[largest]
    quaternions = np.empty((len(words), 4))
    np.put_along_axis(quaternions, order, small, axis=1)
    rest = np.sqrt(np.clip(1 - np.square(small).sum(axis=1), 0, 1))
    np.put_along_axis(quaternions, largest[:, None], rest[:, None], axis=1)
    return quaternions.astype(np.float32)


def _sh_rest(sh: Rows | None, count: int) -> Floats:
    """(N, 3, K) from bytes over -4..4."""
    if sh is None:
        return np.zeros((count, 3, 0), dtype=np.float32)
    names = tuple(f"f_rest_{i}" for i in range(sum(n.startswith("f_rest_") for n in sh.dtype.names or ())))
    values = stack_columns(sh, names).astype(np.float32) * np.float32(8 / 255) - np.float32(4)
    return values.reshape(count, 3, len(names) // 3)


def _sh_dc(colours: Floats) -> Floats:
    with np.errstate(over="ignore", invalid="ignore"):  # broken bounds are masked by _finite_chunks
        return np.asarray((colours - np.float32(0.5)) / np.float32(SH_C0), dtype=np.float32)


def _finite_chunks(chunk: Rows) -> NDArray[np.bool_]:
    """(N,) bool: whether all bounds of a chunk are numbers with which one can calculate."""
    bounds = stack_columns(chunk, chunk.dtype.names or ())
    finite: NDArray[np.bool_] = (np.abs(bounds) <= LARGEST_BOUND).all(axis=1)
    return finite
