"""Checks of a label-map file around SimpleITK: the kind of file before it, the kind of voxels after it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import InputError

LARGEST_LABEL = 2**53  # whole numbers beyond are not kept by floating point
MAX_VOXELS = 4_000_000_000
SUFFIXES = (".nii", ".nii.gz", ".nrrd", ".mha", ".mhd", ".nhdr", ".hdr", ".img", ".img.gz")


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


def check_labels(path: Path, voxels: NDArray[Any]) -> None:
    """InputError where voxels are negative or fractions: an image given instead of its label map."""
    kind = voxels.dtype.kind
    if kind == "u" or voxels.size == 0:
        return
    with np.errstate(invalid="ignore"):  # signalling NaNs, which are no labels either
        fractions = kind == "f" and not (np.array_equal(voxels, np.rint(voxels)) and voxels.max() <= LARGEST_LABEL)
    if fractions or voxels.min() < 0:
        raise InputError(f"{path}: holds negative numbers or fractions, so it is an image; give its label map")


def _is_dicom(path: Path) -> bool:
    if path.suffix.lower() in (".dcm", ".dicom"):
        return True
    if not os.path.isfile(path):
        return False
    with path.open("rb") as file:
        return file.read(132)[128:] == b"DICM"
