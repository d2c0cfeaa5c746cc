"""Which labels a map holds, with names and volumes: for `info` and for errors that list what there is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError
from ..ground.progress import Progress, no_progress
from .label_schemes import scheme_names
from .label_volume import VolumeHeader, slabs
from .segment_table import named_segments
from .volume_checks import check_labels

MAX_LABELS = 10_000


@dataclass(frozen=True)
class LabelCount:
    """One label that occurs: id, layer, name if known, voxel count and volume."""

    label: int
    layer: int
    name: str | None
    voxels: int
    volume_ml: float

    def __str__(self) -> str:
        return f"{self.label}{f' {self.name}' if self.name else ''} ({self.volume_ml:.1f} ml)"


def count_labels(
    header: VolumeHeader, *, label_scheme: str | None = None, progress: Progress = no_progress
) -> tuple[LabelCount, ...]:
    """All labels above 0, sorted by layer and id; InputError where the file is an image, not a label map."""
    names = {(segment.layer, segment.label): segment.name for segment in named_segments(header)}
    scheme = scheme_names(label_scheme)
    found = []
    for layer in range(header.layers):
        counts: dict[int, int] = {}
        for _, voxels in slabs(header, layer, progress=progress):
            _add(counts, voxels, header)
        for label in sorted(counts):
            name = names.get((layer, label), scheme.get(label))
            found.append(LabelCount(label, layer, name, counts[label], counts[label] * header.voxel_ml))
    return tuple(found)


def _add(counts: dict[int, int], voxels: NDArray[Any], header: VolumeHeader) -> None:
    # the background is most of a volume, so it goes first
    values = voxels[voxels != 0]
    check_labels(header.path, values)
    for label, count in zip(*_unique(values), strict=True):
        counts[int(label)] = counts.get(int(label), 0) + int(count)
    if len(counts) > MAX_LABELS:
        raise InputError(f"{header.path}: more than {MAX_LABELS} different values, an image and not a label map")


def _unique(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    if values.dtype.kind == "u" and values.dtype.itemsize <= 2:
        counts = np.bincount(values)
        labels = np.flatnonzero(counts)
        return labels, counts[labels]
    labels, counts = np.unique(values, return_counts=True)
    return labels, counts
