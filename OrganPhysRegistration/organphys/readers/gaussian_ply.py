"""Gaussian splats in PLY files: INRIA's 3DGS layout, 2DGS, SuperSplat's compressed layout, plain coloured points.

INRIA layout (Kerbl et al., "3D Gaussian Splatting for Real-Time Radiance Field Rendering", 2023; its save_ply): opacity
is a logit, scales are natural logs, rot is a quaternion w, x, y, z that is not normalised, f_rest is channel-major,
colour = 0.5 + 0.28209479 f_dc. Coordinates stay raw scene units in file order; nothing is dropped.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from ..ground.checks import InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..points.gaussians import Gaussians
from ..points.point_sets import GaussianCloud
from . import gaussian_fields, supersplat_ply
from .ply_columns import Rows, element_rows, finite_rows, stack_columns
from .ply_header import PlyHeader, read_ply_header


@dataclass(frozen=True)
class SplatInfo:
    """What a splat file holds; bounds (2, 3) of the finite centres, scene units; opaque: opacity above 0.1."""

    path: Path
    kind: str
    format: str
    count: int
    sh_degree: int
    opaque: int
    non_finite: int
    bounds: NDArray[np.floating]
    properties: tuple[str, ...]
    comments: tuple[str, ...]


def read_splat(path: str | Path, *, progress: Progress = no_progress) -> GaussianCloud:
    """What registration needs of a splat: centres, opacities, colours and which Gaussians are finite."""
    header = _checked_header(path)
    rows = element_rows(header)
    if supersplat_ply.is_compressed(header):
        cloud = supersplat_ply.decode_cloud(rows, progress=progress)
    else:
        cloud = _plain_cloud(rows["vertex"], progress)
    return cloud


def read_gaussians(path: str | Path, *, progress: Progress = no_progress) -> Gaussians:
    """Every field of a splat, for writing it again."""
    header = _checked_header(path)
    rows = element_rows(header)
    if supersplat_ply.is_compressed(header):
        return supersplat_ply.decode_gaussians(rows, progress=progress)
    return gaussian_fields.gaussians_from_rows(rows["vertex"], path=header.path, progress=progress)


def describe_splat(path: str | Path, *, progress: Progress = no_progress) -> SplatInfo:
    """Facts of a splat file, for display."""
    header = _checked_header(path)
    cloud = read_splat(path, progress=progress)
    centres = cloud.centres[cloud.valid]
    bounds = np.stack([centres.min(0), centres.max(0)]) if len(centres) else np.full((2, 3), np.nan)
    vertex = header.element("vertex")
    sh = header.element("sh") or vertex
    return SplatInfo(
        path=header.path,
        kind="SuperSplat compressed" if supersplat_ply.is_compressed(header) else _kind(vertex.names if vertex else ()),
        format=header.format,
        count=len(cloud),
        sh_degree=gaussian_fields.sh_degree(sh.names if sh else ()),
        opaque=int((cloud.opacities[cloud.valid] > 0.1).sum()),
        non_finite=int((~cloud.valid).sum()),
        bounds=bounds,
        properties=vertex.names if vertex else (),
        comments=header.comments,
    )


def _plain_cloud(rows: Rows, progress: Progress) -> GaussianCloud:
    names = rows.dtype.names or ()
    valid = finite_rows(rows, progress=progress)
    notices = list(gaussian_fields.non_finite_notices(valid))
    if "opacity" in names:
        opacities = expit(stack_columns(rows, ("opacity",))[:, 0])
    else:
        opacities = np.ones(len(rows), dtype=np.float32)
        notices.append(Notice("no_opacity", "The splat has no opacity, so every point counts as fully opaque."))
    colours = gaussian_fields.plain_colours(rows)
    if colours is None:
        colours = np.full((len(rows), 3), 0.5, dtype=np.float32)
    return GaussianCloud(stack_columns(rows, ("x", "y", "z")), opacities, colours, valid, tuple(notices))


def _kind(names: tuple[str, ...]) -> str:
    if "opacity" not in names:
        return "point cloud"
    return "3D Gaussians" if "scale_2" in names else "2D Gaussians" if "scale_1" in names else "points with opacity"


def _checked_header(path: str | Path) -> PlyHeader:
    header = read_ply_header(path)
    vertex = header.element("vertex")
    if vertex is None or vertex.count == 0:
        raise InputError(f"{header.path}: no vertices in the PLY file; export the splat again")
    if vertex.lists:
        raise InputError(f"{header.path}: the vertices have list properties, so this is no splat; export it again")
    if supersplat_ply.is_compressed(header):
        supersplat_ply.check_layout(header)
        return header
    missing = [name for name in ("x", "y", "z") if name not in vertex.names]
    if missing:
        raise InputError(f"{header.path}: the vertices have no {', '.join(missing)}; a splat needs x, y and z")
    return header
