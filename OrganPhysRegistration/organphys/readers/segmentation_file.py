"""One organ out of a label map or segmentation file (.nii, .nii.gz, .nrrd, .seg.nrrd, .mha, .mhd).

The organ is never guessed: it is named by the file itself, by a label id, or by a name together with a label scheme.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from ..points.point_sets import Organ
from .label_counts import LabelCount, count_labels
from .label_volume import VolumeHeader, read_header, slabs
from .mask_cleaning import Mask
from .organ_choice import OrganChoice, choose_organ, present
from .organ_from_mask import occupied_box, organ_of_crop
from .volume_checks import check_labels


@dataclass(frozen=True)
class SegmentationInfo:
    """What a label map holds: shape and spacing in i, j, k order, pixel type, and its labels with volumes in ml."""

    path: Path
    shape: tuple[int, int, int]
    spacing_mm: tuple[float, float, float]
    pixel_type: str
    layers: int
    labels: tuple[LabelCount, ...]


def read_organ(
    path: str | Path,
    *,
    organ: str | int,
    label_scheme: str | None = None,
    opening: bool = True,
    close_holes: bool = False,
    progress: Progress = no_progress,
) -> Organ:
    """Reads one organ, RAS mm: its largest component, cleaned, with surface, normals and labelled voxel centres.

    ``organ``: a label id (5 or "5"; "1+2" is the union) or a name, which needs a file with names or a ``label_scheme``.
    InputError: file, name or label not usable, or nothing left.
    """
    header = read_header(path)
    choice = choose_organ(header, organ, label_scheme)
    mask, corner = _read_mask(header, choice, progress)
    if mask is None:
        ids = "+".join(map(str, choice.labels))
        wanted = f"label {ids}" if choice.name == f"label {ids}" else f"{choice.name!r} (label {ids})"
        raise InputError(f"{header.path}: {wanted} is not in the map; give one that is {present(header, label_scheme)}")
    return organ_of_crop(mask, corner, header, name=choice.name, opening=opening, close_holes=close_holes)


def describe_segmentation(
    path: str | Path, *, label_scheme: str | None = None, progress: Progress = no_progress
) -> SegmentationInfo:
    """Header facts and the labels present with their volumes, for display."""
    header = read_header(path)
    spacing = header.spacing_mm[::-1]
    return SegmentationInfo(
        path=header.path,
        shape=(header.shape[2], header.shape[1], header.shape[0]),
        spacing_mm=(float(spacing[0]), float(spacing[1]), float(spacing[2])),
        pixel_type=header.pixel_type,
        layers=header.layers,
        labels=count_labels(header, label_scheme=label_scheme, progress=progress),
    )


def _read_mask(header: VolumeHeader, choice: OrganChoice, progress: Progress) -> tuple[Mask | None, NDArray[np.int64]]:
    """Mask of the labels cropped to its box, and the box's first index (3,); None where none occurs."""
    pieces: list[tuple[NDArray[np.int64], Mask]] = []
    for start, voxels in slabs(header, choice.layer, progress=progress):
        check_labels(header.path, voxels)
        found = voxels == choice.labels[0]
        for label in choice.labels[1:]:
            found |= voxels == label
        box = occupied_box(found)
        if box is not None:
            pieces.append((np.array([box[0].start + start, box[1].start, box[2].start]), found[box].copy()))
    if not pieces:
        return None, np.zeros(3, dtype=np.int64)
    low = np.min([corner for corner, _ in pieces], axis=0)
    high = np.max([corner + piece.shape for corner, piece in pieces], axis=0)
    mask = np.zeros(high - low, dtype=bool)
    for corner, piece in pieces:
        first = corner - low
        mask[tuple(slice(f, f + n) for f, n in zip(first, piece.shape, strict=True))] = piece
    return mask, low
