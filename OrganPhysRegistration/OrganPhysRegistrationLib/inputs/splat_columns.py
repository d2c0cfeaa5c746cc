"""A splat file as the columns a splat node holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from organphys.ground.checks import InputError
from organphys.ground.notices import Notice

LARGEST = np.float32(1e30)  # of a Gaussian's extent, so that its square is finite too


@dataclass(frozen=True)
class SplatColumns:
    """One row per Gaussian in file order, nothing dropped.

    centres (N, 3) float32 raw scene units, those not finite at the centroid; colours (N, 3) uint8; opacities (N,)
    float32 in 0..1, 0 where not valid; scales (N, 3) float32, standard deviations in scene units; rotations (N, 4)
    float32 unit quaternions w, x, y, z; valid (N,) bool: every number of the Gaussian is finite.
    """

    centres: NDArray[np.float32]
    colours: NDArray[np.uint8]
    opacities: NDArray[np.float32]
    scales: NDArray[np.float32]
    rotations: NDArray[np.float32]
    valid: NDArray[np.bool_]
    notices: tuple[Notice, ...] = ()


def read_columns(path: str | Path) -> SplatColumns:
    """Columns of a splat PLY (INRIA, 2DGS, SuperSplat) or a plain point cloud. InputError: damaged, no splat.

    Higher-order spherical harmonics are not read: they are most of the file and nothing here shows them.
    """
    from organphys.readers.gaussian_ply import read_splat

    cloud = read_splat(path)
    valid, count = cloud.valid & np.isfinite(cloud.centres).all(axis=1), len(cloud)
    if not valid.any():
        raise InputError(f"{path}: none of its {count} Gaussians is finite; export the splat again")
    log_scales, quaternions = _shapes(path)
    centres, opacities = cloud.centres.astype(np.float32), cloud.opacities.astype(np.float32)
    if not valid.all():
        centres[~valid] = centres[valid].mean(axis=0, dtype=np.float64)
        opacities[~valid] = 0
    return SplatColumns(
        centres=centres,
        colours=_bytes(cloud.colours),
        opacities=opacities,
        scales=_extents(log_scales),
        rotations=_unit_quaternions(quaternions, count),
        valid=valid,
        notices=cloud.notices,
    )


def _shapes(path: str | Path) -> tuple[NDArray[Any], NDArray[Any]]:
    """Log scales (N, 3), (N, 2) or (N, 0) and quaternions (N, 4) or (N, 0) as the file has them."""
    from organphys.readers import supersplat_ply
    from organphys.readers.gaussian_fields import ROTATION
    from organphys.readers.ply_columns import element_rows, stack_columns
    from organphys.readers.ply_header import read_ply_header

    header = read_ply_header(path)
    rows = element_rows(header)
    if supersplat_ply.is_compressed(header):
        gaussians = supersplat_ply.decode_gaussians({name: rows[name] for name in ("vertex", "chunk")})
        return gaussians.log_scales, gaussians.quaternions
    names = rows["vertex"].dtype.names or ()
    scales = tuple(name for name in ("scale_0", "scale_1", "scale_2") if name in names)
    rotation = ROTATION if set(ROTATION) <= set(names) else ()
    return stack_columns(rows["vertex"], scales), stack_columns(rows["vertex"], rotation)


def _bytes(colours: NDArray[Any]) -> NDArray[np.uint8]:
    return (np.nan_to_num(colours, nan=0.5) * 255 + 0.5).astype(np.uint8)


def _extents(log_scales: NDArray[Any]) -> NDArray[np.float32]:
    """Standard deviations (N, 3); flat Gaussians have 0 along the third axis, plain points along all."""
    extents = np.zeros((len(log_scales), 3), dtype=np.float32)
    with np.errstate(over="ignore"):
        known = np.exp(log_scales)
    extents[:, : log_scales.shape[1]] = np.nan_to_num(np.minimum(known, LARGEST), nan=0.0)
    return extents


def _unit_quaternions(quaternions: NDArray[Any], count: int) -> NDArray[np.float32]:
    """Unit quaternions (N, 4); no turn where there is none or it is not usable."""
    unit = np.zeros((count, 4), dtype=np.float32)
    unit[:, 0] = 1
    if quaternions.shape[1] == 4:
        length = np.linalg.norm(quaternions, axis=1)
        usable = np.isfinite(length) & (length > 0)
        unit[usable] = quaternions[usable] / length[usable, None]
    return unit
