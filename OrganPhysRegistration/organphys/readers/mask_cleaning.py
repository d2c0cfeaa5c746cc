"""Cleaning of an organ's voxel mask: largest component, opening by a ball measured in mm, holes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ..ground.checks import Array
from ..ground.notices import Notice

Mask = NDArray[np.bool_]
OPENING_MAY_REMOVE = 0.05  # of the volume
PIECES_WORTH_A_NOTICE = 0.05  # a second kidney, say


def clean_mask(
    mask: Mask, spacing_mm: Array, *, opening: bool = True, close_holes: bool = False
) -> tuple[Mask, tuple[Notice, ...]]:
    """Largest component of a mask (K, J, I), opened and with holes closed where wanted, and what was noticed.

    Opening removes bridges and specks by a ball of one voxel of the smallest spacing; it is left out where it would
    take more than 5 % of the volume (thin organs).
    """
    body, notices = largest_component(mask), []
    dropped = 1 - float(body.sum()) / float(mask.sum())
    if dropped > PIECES_WORTH_A_NOTICE:
        text = (
            f"The label has several separate pieces; the largest is used, {100 * dropped:.0f} % of the volume is not."
        )
        notices.append(Notice("pieces_dropped", text))
    if close_holes:
        body = ndimage.binary_fill_holes(body)
    if opening:
        opened = largest_component(open_by_ball(body, spacing_mm))
        before, after = int(body.sum()), int(opened.sum())
        if after >= (1 - OPENING_MAY_REMOVE) * before:
            body = opened
        else:
            lost = 100 * (1 - after / before)
            notices.append(
                Notice(
                    "opening_skipped",
                    f"Smoothing of the label map was left out: it would have removed {lost:.0f} % of the organ's "
                    "volume (thin parts or coarse voxels).",
                )
            )
    return body, tuple(notices)


def largest_component(mask: Mask) -> Mask:
    """The largest face-connected component of a mask."""
    labels, count = ndimage.label(mask)
    if count <= 1:
        return mask
    sizes = np.bincount(labels[mask])
    largest: Mask = labels == int(sizes.argmax())
    return largest


def ball_offsets(spacing_mm: Array, radius_mm: float) -> NDArray[np.int64]:
    """Index offsets (M, 3), without the zero, whose length in mm is at most the radius."""
    reach = np.floor(radius_mm * (1 + 1e-3) / spacing_mm).astype(int)
    offsets = np.stack(np.meshgrid(*[np.arange(-r, r + 1) for r in reach], indexing="ij"), -1).reshape(-1, 3)
    length = np.linalg.norm(offsets * spacing_mm, axis=1)
    return offsets[(length > 0) & (length <= radius_mm * (1 + 1e-3))]


def open_by_ball(mask: Mask, spacing_mm: Array) -> Mask:
    """Morphological opening by a ball of radius min(spacing) in mm; the outside of the array counts as background.

    With spacing 1 x 1 x 3 mm the ball reaches the in-plane neighbours only.
    """
    offsets = ball_offsets(spacing_mm, float(spacing_mm.min()))
    padded = np.pad(mask, 1)
    eroded = padded.copy()
    for offset in offsets:
        _combine(np.logical_and, eroded, padded, offset)
    opened = eroded.copy()
    for offset in offsets:
        _combine(np.logical_or, opened, eroded, offset)
    inner: Mask = opened[1:-1, 1:-1, 1:-1]
    return inner


def boundary_of(mask: Mask) -> Mask:
    """Voxels of the mask with at least one of six face neighbours outside it."""
    padded = np.pad(mask, 1)
    inside = padded.copy()
    for axis in range(3):
        for step in (-1, 1):
            _combine(np.logical_and, inside, padded, np.eye(3, dtype=int)[axis] * step)
    boundary: Mask = mask & ~inside[1:-1, 1:-1, 1:-1]
    return boundary


def _combine(operation: np.ufunc, result: Mask, source: Mask, offset: NDArray[np.int64]) -> None:
    """result[x] = operation(result[x], source[x + offset]) on a padded array; the frame itself stays as it is."""
    here = tuple(slice(1, n - 1) for n in result.shape)
    there = tuple(slice(1 + o, n - 1 + o) for o, n in zip(offset.tolist(), result.shape, strict=True))
    operation(result[here], source[there], out=result[here])
