"""What the header of a label map declares, read and judged here before any library sees the file.

The native readers trust their headers: teem writes beyond a buffer at a long number, MetaIO at a large NDims, NIfTI's
fills what is missing with zeros. So only files whose header is sound and whose voxels are all there are handed on.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..ground.checks import InputError
from .packed_stream import inflated_bytes
from .volume_checks import MAX_VOXELS

MAX_HEADER_BYTES = 4_000_000
SPARE_BYTES = 4096  # some programs fill up their last block
DEFLATE_LIMIT = 1032  # deflate cannot compress below 1/1032 of the size


@dataclass(frozen=True)
class StoredVolume:
    """sizes: of every axis; components and value_bytes: per voxel and per component; file: where the voxels are, from
    ``offset`` on; packing: "" or "gzip" or "zlib", with ``offset`` counted in the unpacked stream if ``whole``;
    packed_bytes: length of the packed stream where the header states it."""

    sizes: tuple[int, ...]
    components: int
    value_bytes: int
    file: Path
    offset: int
    packing: str = ""
    whole: bool = False
    packed_bytes: int | None = None

    @property
    def voxels(self) -> int:
        """Number of values: all axes and components."""
        count = self.components
        for size in self.sizes:
            count *= size
        return count

    @property
    def declared_bytes(self) -> int:
        return self.voxels * self.value_bytes


def declared_volume(path: Path) -> StoredVolume:
    """What the file declares; InputError unless its header is sound and its voxels are there."""
    from .metaimage_header import read_metaimage
    from .nifti_header import read_nifti
    from .nrrd_header import read_nrrd

    name = path.name.lower()
    try:
        if name.endswith((".nrrd", ".nhdr")):
            volume = read_nrrd(path)
        elif name.endswith((".mha", ".mhd")):
            volume = read_metaimage(path)
        else:
            volume = read_nifti(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or 'damaged'}); copy the file again") from error
    _check_voxels(path, volume)
    return volume


def beside(path: Path, name: str) -> Path:
    """The voxel file that a header names: a file in its own folder, never a path."""
    file = path.with_name(name) if name and name not in (".", "..") and not set(name) & set("/\\:%\0") else None
    if file is None or not file.is_file():
        raise InputError(
            f"{path}: its voxels should be in a file beside it, but it names {name[:80]!r}; keep both in one folder"
        )
    return file


def header_error(path: Path, what: str) -> InputError:
    """The error of a header that cannot be used."""
    return InputError(f"{path}: damaged header ({what}); save it anew from 3D Slicer")


def _check_voxels(path: Path, volume: StoredVolume) -> None:
    """InputError where the header promises more voxels than the file holds, or more than anyone can use."""
    if volume.voxels > MAX_VOXELS:
        raise InputError(f"{path}: {volume.voxels:.3g} voxels declared, at most {MAX_VOXELS} are read; crop the volume")
    if volume.voxels < 1:
        raise InputError(
            f"{path}: expected a 3-dimensional label map, got size {list(volume.sizes)}; export a 3D volume"
        )
    declared = volume.declared_bytes
    held = _held_bytes(volume)
    if held is not None and held < declared:
        raise InputError(
            f"{path}: damaged or truncated, the header declares {declared} bytes of voxels; copy the file again"
        )
    if held is not None and held >= declared + SPARE_BYTES:
        raise InputError(
            f"{path}: holds more voxels than its header declares ({declared} bytes); save it anew from 3D Slicer"
        )


def _held_bytes(volume: StoredVolume) -> int | None:
    """Bytes of voxels that are there, 0 for a damaged packing; None where that is left to the library."""
    size, declared = volume.file.stat().st_size, volume.declared_bytes
    if not volume.packing:
        return size - volume.offset
    if declared > DEFLATE_LIMIT * size:
        return 0
    before = volume.offset if volume.whole else 0
    length = inflated_bytes(
        volume.file,
        0 if volume.whole else volume.offset,
        before + declared,
        gzip_form=volume.packing == "gzip",
        packed_bytes=volume.packed_bytes,
    )
    return None if length is None else length - before
