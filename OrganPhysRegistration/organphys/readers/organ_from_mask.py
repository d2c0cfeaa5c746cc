"""One organ out of a voxel mask in memory: cleaned, with surface, normals and voxel centres."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..ground.checks import Array, InputError
from ..ground.notices import Notice
from ..ground.progress import Progress, no_progress
from ..points.point_sets import Organ
from .mask_cleaning import Mask, boundary_of, clean_mask
from .mask_surface import surface_of_mask
from .voxel_grid import VoxelGrid

BLOCK = 1 << 13  # voxels placed at once: their rows stay in the cache


def organ_from_mask(
    mask: ArrayLike,
    ijk_to_ras: ArrayLike,
    *,
    name: str = "organ",
    opening: bool = True,
    close_holes: bool = False,
    progress: Progress = no_progress,
) -> Organ:
    """The organ of a mask (K, J, I), bool or 0 and 1, RAS mm; the same as ``read_organ`` makes of the same voxels.

    ``ijk_to_ras`` (4, 4): from (i, j, k) indices to RAS mm; may be oblique, left-handed or sheared. The mask is taken
    for the whole volume: an organ at its border is told to be cut. InputError: empty, not 3D, or no usable affine.
    """
    voxels = np.asarray(mask)
    if voxels.ndim != 3:
        raise InputError(f"organ mask: expected an array of shape (K, J, I), got shape {voxels.shape}")
    voxels = voxels.astype(bool, copy=False)
    grid = VoxelGrid.of_affine(voxels.shape, ijk_to_ras)
    progress("read", 0.0)
    box = occupied_box(voxels)
    if box is None:
        raise InputError(f"organ mask: {name} is empty, no voxel is set; draw or choose another segment")
    corner = np.array([edge.start for edge in box])
    organ = organ_of_crop(voxels[box].copy(), corner, grid, name=name, opening=opening, close_holes=close_holes)
    progress("read", 1.0)
    return organ


def occupied_box(mask: Mask) -> tuple[slice, slice, slice] | None:
    """The smallest box that holds all voxels set; None where none is."""
    occupied = [np.flatnonzero(mask.any(axis=axes)) for axes in ((1, 2), (0, 2), (0, 1))]
    if not len(occupied[0]):
        return None
    k, j, i = (slice(int(o[0]), int(o[-1]) + 1) for o in occupied)
    return k, j, i


def organ_of_crop(
    mask: Mask, corner: NDArray[np.int64], grid: VoxelGrid, *, name: str, opening: bool, close_holes: bool
) -> Organ:
    """Organ of a mask cropped to its box; ``corner`` (3,): index (k, j, i) of the box's first voxel in ``grid``."""
    mask, notices = clean_mask(mask, grid.spacing_mm, opening=opening, close_holes=close_holes)
    if _at_border(mask, corner, grid.shape):
        text = f"The {name} touches the border of the volume: the part beyond it is missing and its end is flat."
        notices = (*notices, Notice("organ_cut_by_border", text))
    surface = surface_of_mask(mask, origin=grid.world(corner[None])[0], step=grid.step_ras)
    inside = np.flatnonzero(mask)
    return Organ(
        vertices=surface.vertices,
        faces=surface.faces,
        vertex_normals=surface.normals,
        volume_points=_centres(inside, mask.shape, corner, grid),
        boundary=boundary_of(mask).ravel()[inside],
        spacing_mm=grid.spacing_mm[::-1].copy(),
        volume_ml=len(inside) * grid.voxel_ml,
        name=name,
        notices=notices,
    )


def _at_border(mask: Mask, corner: NDArray[np.int64], shape: tuple[int, int, int]) -> bool:
    """Whether the mask reaches a face of the whole volume of ``shape``."""
    first = [mask.take(0, axis).any() and corner[axis] == 0 for axis in range(3)]
    last = [mask.take(-1, axis).any() and corner[axis] + mask.shape[axis] == shape[axis] for axis in range(3)]
    return any(first) or any(last)


def _centres(inside: NDArray[np.int64], shape: tuple[int, ...], corner: NDArray[np.int64], grid: VoxelGrid) -> Array:
    """RAS mm positions (N, 3) of flat indices ``inside`` (N,) of the cropped mask; in blocks of bounded memory."""
    centres = np.empty((len(inside), 3))
    for start in range(0, len(inside), BLOCK):
        part = slice(start, start + BLOCK)
        centres[part] = grid.world(np.stack(np.unravel_index(inside[part], shape), axis=1) + corner)
    return centres
