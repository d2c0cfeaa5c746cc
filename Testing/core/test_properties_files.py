"""The same organ out of any file of it: axes RAS, LPS, IPL and others, NIfTI and NRRD, and any frame an NRRD names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from reader_samples import blob, write_labels
from scipy.spatial import cKDTree

from organphys.points.point_sets import Organ
from organphys.readers.segmentation_file import read_organ

SPACING = np.array([1.2, 0.8, 2.0])
ORIGIN = np.array([10.0, -200.0, 55.0])
TOWARDS = {"R": (0, 1), "L": (0, -1), "A": (1, 1), "P": (1, -1), "S": (2, 1), "I": (2, -1)}
"""Anatomical direction in which an axis grows: the RAS axis and its sign."""
CODES = ("RAS", "LPS", "IPL", "LIA", "SRP")
FRAMES = {
    "left-posterior-superior": (-1, -1, 1),
    "right-anterior-superior": (1, 1, 1),
    "left-anterior-superior": (-1, 1, 1),
}


def regridded(code: str) -> tuple[np.ndarray, np.ndarray]:
    """The organ's labels (i, j, k) on a grid whose axes grow towards ``code``, and the affine (4, 4) to RAS mm."""
    axes, signs = zip(*(TOWARDS[letter] for letter in code), strict=True)
    mask = blob((24, 30, 20), spacing=tuple(SPACING))
    affine = np.eye(4)
    affine[:3, 3] = ORIGIN
    for new, (old, sign) in enumerate(zip(axes, signs, strict=True)):
        affine[:3, new] = sign * SPACING[old] * np.eye(3)[old]
        affine[:3, 3] += (sign < 0) * SPACING[old] * (mask.shape[old] - 1) * np.eye(3)[old]
    turned = mask.transpose(axes)[tuple(slice(None, None, sign) for sign in signs)]
    return turned.astype(np.uint8), affine


def write_nrrd(path: Path, labels: np.ndarray, affine: np.ndarray, frame: str) -> Path:
    """An NRRD by hand whose header states positions in ``frame``."""
    to_frame = np.array(FRAMES[frame])
    step, origin = affine[:3, :3].T * to_frame, affine[:3, 3] * to_frame
    vectors = " ".join("(" + ",".join(f"{value:.17g}" for value in row) + ")" for row in step)
    header = (
        f"NRRD0004\ntype: unsigned char\ndimension: 3\nspace: {frame}\nsizes: {' '.join(map(str, labels.shape))}\n"
        f"space directions: {vectors}\nkinds: domain domain domain\nencoding: raw\n"
        f"space origin: ({','.join(f'{value:.17g}' for value in origin)})\n\n"
    )
    path.write_bytes(header.encode() + labels.tobytes(order="F"))
    return path


def rows(points: np.ndarray) -> np.ndarray:
    rounded = np.round(points, 3) + 0.0
    return rounded[np.lexsort(rounded.T)]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Organ:
    labels, affine = regridded("RAS")
    organ = read_organ(write_labels(tmp_path_factory.mktemp("ras") / "a.nrrd", labels, affine=affine), organ=1)
    inside = np.argwhere(labels) * SPACING + ORIGIN
    assert len(organ.volume_points) > 0.8 * len(inside)  # the opening takes some spurs
    assert set(map(tuple, rows(organ.volume_points))) <= set(map(tuple, rows(inside)))
    return organ


def same(organ: Organ, reference: Organ) -> None:
    np.testing.assert_allclose(rows(organ.volume_points), rows(reference.volume_points), atol=2e-3)
    np.testing.assert_allclose(rows(organ.boundary_points), rows(reference.boundary_points), atol=2e-3)
    assert len(organ.vertices) == len(reference.vertices)
    assert cKDTree(reference.vertices).query(organ.vertices)[0].max() < 2e-3
    assert organ.volume_ml == pytest.approx(reference.volume_ml, rel=1e-5)
    outward = organ.vertices - organ.volume_points.mean(0)
    assert (organ.vertex_normals * outward).sum(1).mean() > 3


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("suffix", [".nii.gz", ".nrrd"])
def test_axes_and_formats(tmp_path: Path, reference: Organ, code: str, suffix: str) -> None:
    labels, affine = regridded(code)
    same(read_organ(write_labels(tmp_path / f"a{suffix}", labels, affine=affine), organ=1), reference)


@pytest.mark.parametrize("code", ["RAS", "IPL"])
@pytest.mark.parametrize("frame", FRAMES)
def test_nrrd_in_any_frame(tmp_path: Path, reference: Organ, code: str, frame: str) -> None:
    labels, affine = regridded(code)
    same(read_organ(write_nrrd(tmp_path / "a.nrrd", labels, affine, frame), organ=1), reference)
