"""Which organs a segmentation file names: .seg.nrrd segment keys and the label table of a NIfTI extension."""

from __future__ import annotations

import gzip
import re
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

from ..ground.checks import one_line
from .label_volume import VolumeHeader

MAX_EXTENSION_BYTES = 4_000_000
LONGEST_NAME = 200


@dataclass(frozen=True)
class Segment:
    """One organ of a file: ``label`` value in label map number ``layer``."""

    label: int
    layer: int = 0
    name: str | None = None


def named_segments(header: VolumeHeader) -> tuple[Segment, ...]:
    """Segments the file itself names, in file order; empty where it carries no names."""
    segments = _slicer_segments(header)
    if not segments and header.path.name.lower().endswith((".nii", ".nii.gz")):
        segments = _nifti_segments(header.path)
    return tuple(segments)


def _slicer_segments(header: VolumeHeader) -> list[Segment]:
    """3D Slicer's keys Segment<N>_Name, _LabelValue, _Layer (Slicer documentation, "Segmentation file formats").

    Extents are relative to the stored image and only save work, so they are not needed. Before Slicer 4.11 there was
    no LabelValue and no Layer: each segment had its own layer with value 1.
    """
    found = []
    for key, name in header.metadata.items():
        match = re.fullmatch(r"Segment(\d{1,6})_Name", key)
        if match:
            found.append((int(match[1]), _shown(name)))
    segments = []
    for number, name in sorted(found):
        value = _integer(header.metadata.get(f"Segment{number}_LabelValue"), default=1)
        own_layer = number if header.layers > 1 else 0
        layer = _integer(header.metadata.get(f"Segment{number}_Layer"), default=own_layer)
        if 0 <= layer < header.layers:
            segments.append(Segment(value, layer, name))
    return segments


def _nifti_segments(path: Path) -> list[Segment]:
    """Names of a Caret/Connectome label table (<Label Key="5">liver</Label>), as TotalSegmentator writes it."""
    text = _nifti_extension(path).decode("utf-8", errors="replace")
    tags = re.findall(r"<Label\s([^<>]{1,1000})>\s{0,20}(?:<!\[CDATA\[)?([^<\]]{1,200})", text)
    found = [(re.search(r'Key="(\d{1,9})"', attributes), name) for attributes, name in tags]
    return [Segment(int(key[1]), 0, _shown(name)) for key, name in found if key is not None and int(key[1]) != 0]


def _shown(name: str) -> str:
    return one_line(name.strip(), longest=LONGEST_NAME)


def _nifti_extension(path: Path) -> bytes:
    """Bytes between the NIfTI header and the voxels (bounded); empty where there are none."""
    try:
        with gzip.open(path) if path.name.lower().endswith(".gz") else path.open("rb") as file:
            head = file.read(352)
            if len(head) < 352 or head[348] == 0:
                return b""
            order = "little" if int.from_bytes(head[:4], "little") == 348 else "big"
            offset = struct.unpack_from("<f" if order == "little" else ">f", head, 108)[0]
            if not 352 < offset <= MAX_EXTENSION_BYTES:
                return b""
            return file.read(int(offset) - 352)
    except (OSError, EOFError, zlib.error):
        return b""


def _integer(text: str | None, *, default: int) -> int:
    try:
        return default if text is None else int(text)
    except ValueError:
        return default
