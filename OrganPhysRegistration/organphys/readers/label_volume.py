"""Label maps and segmentations on disk: header first, voxels slab by slab, so that memory stays bounded.

Index order is the file's reversed, (k, j, i) as numpy shows a SimpleITK image. World coordinates are RAS mm: ITK's
LPS is flipped here and nowhere else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, InputError
from ..ground.frames import ras_from_lps
from ..ground.progress import Progress, no_progress
from .library_messages import library_messages, tells_damage
from .stored_volume import declared_volume
from .volume_checks import check_is_volume_file
from .voxel_grid import VoxelGrid, check_extent

STREAM_ABOVE_BYTES = 300_000_000  # larger NIfTI files are read in slabs; ITK holds each slab twice
IMAGE_IO = {".nrrd": "NrrdImageIO", ".nhdr": "NrrdImageIO", ".mha": "MetaImageIO", ".mhd": "MetaImageIO"}
SLAB_VOXELS = 8_000_000  # what is compared or counted at once


@dataclass(frozen=True, kw_only=True)
class VolumeHeader(VoxelGrid):
    """Facts of a label map before its voxels are read; ``layers``: label maps stored side by side."""

    path: Path
    layers: int
    pixel_type: str
    bytes_per_voxel: int
    metadata: dict[str, str] = field(default_factory=dict, repr=False)


def read_header(path: str | Path) -> VolumeHeader:
    """Header of a .nii, .nii.gz, .nrrd, .seg.nrrd, .mha or .mhd file; InputError where it cannot be a label map."""
    import SimpleITK as sitk

    path = Path(path)
    check_is_volume_file(path)
    declared = declared_volume(path)
    reader = _reader(path)
    messages: list[str] = []
    try:
        with library_messages() as messages:
            reader.ReadImageInformation()
    except RuntimeError as error:
        reason = _reason(error, messages)
        raise InputError(f"{path}: not readable as a label map ({reason}); save it anew from 3D Slicer") from error
    size, dimension = reader.GetSize(), reader.GetDimension()
    components = reader.GetNumberOfComponents()
    if dimension not in (3, 4) or (dimension == 4 and components > 1) or min(size) < 1:
        raise InputError(f"{path}: expected a 3-dimensional label map, got size {list(size)}; export a 3D volume")
    pixel_type = sitk.GetPixelIDValueAsString(reader.GetPixelID())
    header = VolumeHeader(
        path=path,
        shape=(size[2], size[1], size[0]),
        layers=size[3] if dimension == 4 else components,
        pixel_type=pixel_type,
        bytes_per_voxel=_bytes_per_voxel(pixel_type, path),
        metadata={key: reader.GetMetaData(key) for key in reader.GetMetaDataKeys()},
        **_geometry(reader, dimension),
    )
    check_extent(header, str(path))
    if int(np.prod(size, dtype=np.int64)) * components != declared.voxels:
        raise InputError(f"{path}: its header can be understood in two ways; save it anew from 3D Slicer")
    return header


def slabs(
    header: VolumeHeader, layer: int = 0, *, progress: Progress = no_progress
) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yields (first index along axis 0, voxels (n, J, I) of one layer in the file's type), valid until the next."""
    depth = header.shape[0]
    rows = max(1, SLAB_VOXELS // (header.shape[1] * header.shape[2]))
    for start, stop in _read_ranges(header):
        image = _read(header, start, stop)
        voxels = _layer_view(image, layer)
        for low in range(0, stop - start, rows):
            progress("read", (start + low) / depth)
            yield start + low, voxels[low : low + rows]
    progress("read", 1.0)


def _read_ranges(header: VolumeHeader) -> list[tuple[int, int]]:
    """Ranges along axis 0 to read at a time. Only NIfTI streams in ITK (a .gz is inflated up to the slab again)."""
    depth = header.shape[0]
    total = int(np.prod(header.shape)) * header.bytes_per_voxel
    streams = header.path.name.lower().endswith((".nii", ".nii.gz")) and header.layers == 1
    parts = -(-total // STREAM_ABOVE_BYTES) if streams else 1
    edges = np.linspace(0, depth, min(parts, depth) + 1).astype(int).tolist()
    return list(pairwise(edges))


def _read(header: VolumeHeader, start: int, stop: int) -> Any:
    """SimpleITK image of the slices [start:stop]."""
    reader = _reader(header.path)
    if (start, stop) != (0, header.shape[0]):
        reader.SetExtractIndex((0, 0, start))
        reader.SetExtractSize((header.shape[2], header.shape[1], stop - start))
    messages: list[str] = []
    try:
        with library_messages() as messages:
            image = reader.Execute()
    except (RuntimeError, MemoryError) as error:
        raise _damaged(header.path, _reason(error, messages)) from error
    if tells_damage(messages):
        raise _damaged(header.path, messages[0])
    return image


def _layer_view(image: Any, layer: int) -> NDArray[Any]:
    """View (n, J, I) of one layer: layers are the fourth axis of a 4D image or the components of a vector pixel."""
    import SimpleITK as sitk

    voxels: NDArray[Any] = sitk.GetArrayViewFromImage(image)
    if image.GetDimension() == 4:
        return voxels[layer]
    return voxels[..., layer] if voxels.ndim == 4 else voxels


def _reader(path: Path) -> Any:
    import SimpleITK as sitk

    sitk.ProcessObject.SetGlobalWarningDisplay(False)  # what matters is raised; a command prints one line
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    name = path.name.lower()
    reader.SetImageIO(next((io for ending, io in IMAGE_IO.items() if name.endswith(ending)), "NiftiImageIO"))
    return reader


def _geometry(reader: Any, dimension: int) -> dict[str, Array]:
    direction = np.array(reader.GetDirection(), dtype=np.float64).reshape(dimension, dimension)[:3, :3]
    with np.errstate(all="ignore"):  # what is no length is told by check_extent
        step_lps = direction * np.array(reader.GetSpacing()[:3])  # columns: i, j, k
        return {
            "origin_ras": ras_from_lps(np.array(reader.GetOrigin()[:3])),
            "step_ras": ras_from_lps(step_lps[:, ::-1].T).T,
        }


def _bytes_per_voxel(pixel_type: str, path: Path) -> int:
    for bits in (8, 16, 32, 64):
        if f"{bits}-bit" in pixel_type and "complex" not in pixel_type:
            return bits // 8
    raise InputError(f"{path}: pixel type {pixel_type!r} is no label type; save the labels as integers")


def _damaged(path: Path, reason: str) -> InputError:
    return InputError(f"{path}: damaged or incomplete ({reason}); copy it again with all its parts")


def _reason(error: BaseException, messages: list[str]) -> str:
    """What the library printed, else the last, most specific line of its error."""
    if messages:
        return messages[0][:160]
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[-1] if lines else type(error).__name__)[:160]
