"""Checks of a label-map file before SimpleITK allocates for it: kind of file, declared size against real size."""

from __future__ import annotations

import gzip
import os
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError

MAX_VOXELS = 4_000_000_000
SUFFIXES = (".nii", ".nii.gz", ".nrrd", ".mha", ".mhd", ".nhdr", ".hdr", ".img", ".img.gz")
CHECKED_BYTES = 100_000_000  # a third of a second
DEFLATE_LIMIT = 1032  # deflate cannot compress below 1/1032 of the size
DETACHED = (".mhd", ".nhdr", ".hdr", ".img", ".img.gz")


def check_is_volume_file(path: Path) -> None:
    """InputError unless ``path`` is a file with a known ending; DICOM gets the conversion named."""
    if os.path.isfile(path) and not os.access(path, os.R_OK):
        raise InputError(f"{path}: cannot be read; check its permissions")
    if os.path.isdir(path) or _is_dicom(path):
        what = "this is a folder, and DICOM" if os.path.isdir(path) else "DICOM"
        raise InputError(
            f"{path}: {what} is not read directly; load it in 3D Slicer and save the segmentation as .seg.nrrd, "
            "or convert a DICOM SEG with dcmqi's segimage2itkimage"
        )
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file; give a label map (.nii.gz, .nrrd, .seg.nrrd, .mha)")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty; copy or export it again")
    if not path.name.lower().endswith(SUFFIXES):
        raise InputError(f"{path}: unknown kind of label map; give .nii, .nii.gz, .nrrd, .seg.nrrd, .mha or .mhd")


def check_declared_size(path: Path, *, voxels: int, bytes_per_voxel: int) -> None:
    """InputError where the header promises more voxels than the file can hold, or more than anyone can use."""
    if voxels > MAX_VOXELS:
        raise InputError(f"{path}: {voxels} voxels declared, at most {MAX_VOXELS} are read; crop the volume")
    name, declared = path.name.lower(), voxels * bytes_per_voxel
    if name.endswith(DETACHED):
        return  # the voxels are in another file, which ITK checks itself
    size = path.stat().st_size
    # ITK's NIfTI reader fills what is missing with zeros and says nothing, so a cut file has to be found here
    if name.endswith(".nii"):
        complete = size >= declared + 348
    elif declared > DEFLATE_LIMIT * size:
        complete = False
    elif name.endswith(".nii.gz"):
        complete = _gzip_holds(path, declared + 348)
    else:
        complete = True
    if not complete:
        raise InputError(
            f"{path}: damaged or truncated, the header declares {declared} bytes of voxels; copy the file again"
        )


def check_labels(path: Path, voxels: NDArray[Any]) -> None:
    """InputError where voxels are negative or fractions: an image given instead of its label map."""
    kind = voxels.dtype.kind
    if kind == "u" or voxels.size == 0:
        return
    if voxels.min() < 0 or (kind == "f" and not np.array_equal(voxels, np.rint(voxels))):
        raise InputError(f"{path}: holds negative numbers or fractions, so it is an image; give its label map")


def _gzip_holds(path: Path, expected: int) -> bool:
    """Whether a gzip file inflates to at least ``expected`` bytes.

    Its last four bytes are the inflated size modulo 2^32, which settles it for an intact single-member file; only where
    that differs, or the file is small, is it inflated, in bounded memory, to the end, which also checks its CRC.
    """
    with path.open("rb") as file:
        if file.read(2) != b"\x1f\x8b":
            return path.stat().st_size >= expected  # not compressed in spite of its name
        file.seek(-4, 2)
        if expected > CHECKED_BYTES and 0 <= int.from_bytes(file.read(4), "little") - expected % 2**32 < 4096:
            return True
    total = 0
    try:
        with gzip.open(path) as stream:
            while total <= expected + CHECKED_BYTES and (block := stream.read(1 << 22)):
                total += len(block)
    except (EOFError, OSError, zlib.error):
        return False
    return total >= expected


def _is_dicom(path: Path) -> bool:
    if path.suffix.lower() in (".dcm", ".dicom"):
        return True
    if not os.path.isfile(path):
        return False
    with path.open("rb") as file:
        return file.read(132)[128:] == b"DICM"
