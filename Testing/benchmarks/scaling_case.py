"""Synthetic cases of any size from the generated sample: its label map at any voxel, its Gaussians split into many."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy import ndimage

from organphys.exports.gaussian_ply import write_gaussians
from organphys.exports.sample_files import write_label_map
from organphys.pipeline import sample_organ
from organphys.pipeline.sample_case import write_sample_case
from organphys.points.gaussians import Gaussians
from organphys.readers.gaussian_ply import read_gaussians
from organphys.simulation.gaussian_shapes import axes

LEVEL_MM = 2.0  # grid on which the organ's formula is evaluated; finer maps interpolate it
SLAB = 2_000_000  # voxels made at once


def write_splat_of(path: Path, sample: Path, count: int, sh_degree: int) -> None:
    """A splat of ``count`` Gaussians: those of ``sample`` drawn again and again, each moved within its own ellipsoid.

    Density, noise and outliers stay those of the sample. ``sh_degree`` adds coefficients of 0, for the file's size.
    """
    few, rng = read_gaussians(sample), np.random.default_rng(0)
    parts = -(-count // len(few))
    chosen = np.concatenate([np.arange(len(few))] * parts)[:count] if parts > 1 else np.arange(count)
    means = few.means[chosen].astype(np.float64)
    if parts > 1:
        semi = axes(few, np.arange(len(few)))
        means += np.einsum("nij,nj->ni", semi[chosen], rng.normal(size=(count, 3)))
    write_gaussians(path, _rows(replace(few, means=means.astype(np.float32)), chosen, sh_degree))


def write_labels_of(path: Path, voxels: int) -> int:
    """The sample's organ in a label map of about ``voxels`` voxels along RAS; returns how many are the organ's."""
    level, low, size = _level()
    step = float((np.prod(size) / voxels) ** (1 / 3))
    shape = np.maximum(np.ceil(size / step).astype(int), 2)
    labels = np.empty(shape, dtype=np.uint8)
    rows = max(1, SLAB // int(np.prod(shape[1:])))
    for start in range(0, shape[0], rows):
        stop = min(start + rows, shape[0])
        index = np.meshgrid(np.arange(start, stop), *map(np.arange, shape[1:]), indexing="ij")
        places = np.stack([axis.ravel() for axis in index]) * (step / LEVEL_MM)
        inside = ndimage.map_coordinates(level, places, order=1, mode="nearest") < 0
        labels[start:stop] = sample_organ.LABELS["liver"] * inside.reshape(stop - start, *shape[1:])
    affine = np.diag([step, step, step, 1.0])
    affine[:3, 3] = low
    write_label_map(path, labels, affine)
    return int((labels > 0).sum())


def sample_splat(folder: Path) -> Path:
    """The full sample case, written once."""
    if not (folder / "splat.ply").exists():
        write_sample_case(folder, size="full")
    return folder / "splat.ply"


@cache
def _level() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The organ's implicit function on a grid (nx, ny, nz), the grid's corner (3,) RAS mm, and its size (3,) mm."""
    low, high = sample_organ.REACH + sample_organ.CENTRE
    axes_mm = [np.arange(a, b, LEVEL_MM) for a, b in zip(low, high, strict=True)]
    nodes = np.stack(np.meshgrid(*axes_mm, indexing="ij"), -1)
    level = sample_organ.level(nodes.reshape(-1, 3)).reshape(nodes.shape[:3])
    return level.astype(np.float32), low, LEVEL_MM * (np.array(level.shape) - 1)


def _rows(gaussians: Gaussians, chosen: np.ndarray, sh_degree: int) -> Gaussians:
    """The fields other than the means at the rows ``chosen``."""
    names = ("log_scales", "quaternions", "opacity_logits", "sh_dc", "valid")
    fields = {name: getattr(gaussians, name)[chosen] for name in names}
    rest = np.zeros((len(chosen), 3, (sh_degree + 1) ** 2 - 1), dtype=np.float32)
    return replace(gaussians, **fields, sh_rest=rest, extra={})
