"""Messages about damaged label maps, splats and assets, and of single steps, as far as no other test raises them."""

from __future__ import annotations

import argparse
import re
import struct
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from asset_examples import bent_organ
from reader_samples import write_labels

from organphys.asset.array_archive import archive_bytes, check_numbers, read_archive
from organphys.asset.asset_file import asset_bytes, asset_from_bytes, check_similarities
from organphys.ground.checks import InputError
from organphys.pipeline import paper_method
from organphys.pipeline.commands_export import _time
from organphys.pipeline.live_request import changes_of
from organphys.pipeline.points_file import read_points
from organphys.pipeline.server_requests import _pose
from organphys.pipeline.session import RegistrationSession
from organphys.readers.gaussian_ply import read_splat
from organphys.readers.label_counts import _add
from organphys.readers.label_volume import read_header
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.segmentation_file import read_organ
from organphys.readers.voxel_grid import VoxelGrid, check_extent

HEAD = "ply\nformat ascii 1.0\n"
XYZ = "property float x\nproperty float y\nproperty float z\n"


def nifti(*, kind: int = 2, bits: int = 8, slope: float = 1.0, sizes: tuple[int, ...] = (3, 2, 2, 2)) -> bytes:
    """A NIfTI-1 file of eight voxels, 1 mm wide."""
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, *sizes, *[1] * (8 - len(sizes)))
    struct.pack_into("<2h", head, 70, kind, bits)
    struct.pack_into("<8f", head, 76, *[1.0] * 8)
    struct.pack_into("<3f", head, 108, 352, slope, 0)
    head[344:348] = b"n+1\0"
    return bytes(head) + bytes(8)


FILES: dict[str, tuple[str, bytes, Callable[[Path], object]]] = {
    "data type 32 of 64 bits is no label type": ("a.nii", nifti(kind=32, bits=64), read_header),
    "its values are scaled": ("a.nii", nifti(slope=2.0), read_header),
    "expected a 3-dimensional label map": ("a.nii", nifti(sizes=(2, 4, 2)), read_header),
    "too short for a NIfTI header": ("a.nii", nifti()[:100], read_header),
    "several elements of one name": ("s.ply", f"{HEAD}element a 0\nelement a 0\nend_header\n".encode(), read_splat),
    "an element with lists comes before others": (
        "s.ply",
        f"{HEAD}element face 1\nproperty list uchar int i\nelement vertex 1\n{XYZ}end_header\n0\n1 2 3\n".encode(),
        read_splat,
    ),
    "so this is no splat; export it again": (
        "s.ply",
        (HEAD + "element vertex 1\n" + "".join(f"property int p{k}\n" for k in range(5000)) + "end_header\n").encode(),
        read_splat,
    ),
    "a line cannot be taken apart": ("l.fcsv", b"a," + b"1" * 200_000 + b",2,3\n", read_landmarks),
}


@pytest.mark.parametrize("words", FILES)
def test_damaged_files(words: str, tmp_path: Path) -> None:
    name, content, read = FILES[words]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=re.escape(words)):
        read(tmp_path / name)


def test_array_of_another_shape(tmp_path: Path) -> None:
    np.save(tmp_path / "points.npy", np.zeros((3, 2)))
    with pytest.raises(InputError, match=r"expected a whole array of shape \(N, 3\)"):
        read_points(tmp_path / "points.npy")


def grid(step: np.ndarray, origin: float = 0.0) -> VoxelGrid:
    return VoxelGrid(shape=(2, 2, 2), origin_ras=np.full(3, origin), step_ras=step)


@pytest.mark.parametrize(
    ("volume", "words"),
    [
        (grid(np.zeros((3, 3))), "voxel spacing is no length in mm"),
        (grid(np.eye(3), 1e12), "the origin of the voxels is not a place"),
        (grid(np.array([[1.0, 1, 0], [0, 0, 0], [0, 0, 1]])), "axes do not span a volume; check"),
    ],
)
def test_voxels_that_are_nowhere(volume: VoxelGrid, words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_extent(volume, "map")


def test_images_are_no_label_maps() -> None:
    header = SimpleNamespace(path="image.nrrd")
    with pytest.raises(InputError, match="different values, an image and not a label map"):
        _add({}, np.arange(1, 60_000).astype(np.uint16), header)  # type: ignore[arg-type]


def test_numbers_that_no_asset_has() -> None:
    with pytest.raises(InputError, match="holds numbers that are not finite or beyond"):
        check_numbers({"z": np.array([np.nan])}, "asset")
    with pytest.raises(InputError, match="a rotation or translation that is not finite"):
        check_similarities(np.eye(3)[None], np.full(3, np.inf))


def test_kernels_that_no_asset_has(tmp_path: Path) -> None:
    (tmp_path / "whole").write_bytes(asset_bytes(bent_organ()))
    header, arrays = read_archive(tmp_path / "whole", "organ.json")
    arrays["basis/radii"] = np.zeros_like(arrays["basis/radii"])
    with pytest.raises(InputError, match="kernels without extent"):
        asset_from_bytes(archive_bytes("organ.json", header, arrays))


def test_requests_that_say_nothing() -> None:
    with pytest.raises(InputError, match='update: name "landmarks" or "stiffness"'):
        changes_of({}, None)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="stiffness must be a preset or a number"):
        changes_of({"stiffness": True}, None)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected a 4 x 4 matrix of numbers"):
        _pose("nowhere")


def test_steps_asked_of_the_wrong_kind() -> None:
    with pytest.raises(InputError, match="--at: expected seconds or all"):
        _time(argparse.Namespace(at="noon"))
    with pytest.raises(InputError, match="method: expected organphys, which alone can be followed"):
        RegistrationSession.default_method.fget(SimpleNamespace(_method=None))  # type: ignore[attr-defined]


def test_notices_of_the_papers_method() -> None:
    (twist,) = paper_method._twist_notices(SimpleNamespace(margin=0.01, chosen_twist_deg=30.0))  # type: ignore[arg-type]
    (radius,) = paper_method._radius_notices(12.0)
    assert "only 1.0 % worse" in twist.message and "12 mm" in radius.message


def test_two_segments_of_one_name(tmp_path: Path) -> None:
    keys = {f"Segment{k}_{name}": value for k in (0, 1) for name, value in (("Name", "liver"), ("LabelValue", k + 1))}
    labels = np.zeros((12, 12, 12), dtype=np.uint8)
    labels[2:6], labels[7:10] = 1, 2
    path = write_labels(tmp_path / "a.seg.nrrd", labels, metadata=keys)
    with pytest.raises(InputError, match="2 segments are named 'liver'; rename all but one"):
        read_organ(path, organ="liver")
