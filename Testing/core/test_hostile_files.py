"""Files made to exhaust memory or time, or to lead the reader elsewhere: each is refused at once, in one line."""

from __future__ import annotations

import gzip
import time
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from organphys.asset.asset_file import load_asset
from organphys.ground.checks import InputError, one_line
from organphys.ground.npy_header import npy_header
from organphys.ground.strict_json import parse_json
from organphys.pipeline.batch_table import read_batch
from organphys.pipeline.points_file import read_points
from organphys.points.point_sets import Landmarks
from organphys.readers.gaussian_ply import read_splat
from organphys.readers.landmark_pairs import paired_landmarks
from organphys.readers.landmarks_file import read_landmarks
from organphys.readers.pins_file import read_pins
from organphys.readers.roi_file import read_box
from organphys.readers.segmentation_file import describe_segmentation
from organphys.readers.trajectory_file import read_trajectory

MARKUPS = '{"markups": [{"type": "Fiducial", "controlPoints": [{"position": [1, 2, 3], "description": "%s"}]}]}'
NRRD = "NRRD0004\ntype: %s\ndimension: 3\nsizes: 4 4 4\nspace origin: (0,0,0)\nencoding: raw\n"


def refused(read: Callable[[Path], object], path: Path, says: str, *, megabytes: float = 30) -> None:
    """InputError within five seconds of processor time and the memory given."""
    tracemalloc.start()
    began = time.process_time()
    with pytest.raises(InputError, match=says) as raised:
        read(path)
    spent, (_, peak) = time.process_time() - began, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert str(raised.value).isprintable() and spent < 5 and peak < megabytes * 1e6


def nifti(sizes: tuple[int, ...], *, held: int) -> bytes:
    """A header that declares one byte for each voxel, and as many zeros as are held."""
    head = bytearray(352)
    head[0:4], head[344:348] = (348).to_bytes(4, "little"), b"n+1\0"
    head[40:56] = np.array([len(sizes), *sizes, *[1] * (7 - len(sizes))], dtype="<i2").tobytes()
    head[70:74] = np.array([2, 8], dtype="<i2").tobytes()
    head[76:92] = np.ones(4, dtype="<f4").tobytes()
    head[108:112] = np.float32(352).tobytes()
    return bytes(head) + bytes(held)


def packed_zeros(start: bytes, count: int) -> bytes:
    maker = zlib.compressobj(9, zlib.DEFLATED, 31)
    out = maker.compress(start)
    block = bytes(1 << 20)
    for _ in range(count >> 20):
        out += maker.compress(block)
    return out + maker.flush()


def test_a_stream_that_holds_less_than_its_header_declares(tmp_path: Path) -> None:
    path = tmp_path / "a.nii.gz"
    path.write_bytes(gzip.compress(nifti((1500, 512, 512), held=500_000)))
    refused(describe_segmentation, path, "declares 393216000 bytes")


def test_a_stream_that_holds_far_more_than_its_header_declares(tmp_path: Path) -> None:
    path = tmp_path / "a.nii.gz"
    path.write_bytes(packed_zeros(nifti((8, 8, 8), held=0), 120 << 20))
    refused(describe_segmentation, path, "holds more voxels than its header declares")


@pytest.mark.parametrize("data_file", ["../secret.raw", "/etc/passwd", "LIST", "a%d.raw 1 9 1", "..", "none.raw"])
def test_voxels_elsewhere_are_not_fetched(tmp_path: Path, data_file: str) -> None:
    (tmp_path / "secret.raw").write_bytes(bytes(64))
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "a.nhdr").write_text(NRRD % "uchar" + f"data file: {data_file}\n")
    refused(describe_segmentation, folder / "a.nhdr", "keep both in one folder")
    (folder / "a.nrrd").write_text(NRRD % "uchar" + f"data file: {data_file}\n\n")
    refused(describe_segmentation, folder / "a.nrrd", "only a .nhdr may name")
    mha = f"ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementType = MET_UCHAR\nElementDataFile = {data_file}\n"
    (folder / "a.mhd").write_text(mha)
    refused(describe_segmentation, folder / "a.mhd", "keep both in one folder")


def test_detached_voxels_in_the_same_folder_are_read(tmp_path: Path) -> None:
    labels = np.zeros((4, 4, 4), dtype=np.uint8)
    labels[1:3, 1:3, 1:3] = 3
    for name in ("a.mhd", "b.nhdr"):
        sitk.WriteImage(sitk.GetImageFromArray(labels), str(tmp_path / name))
        info = describe_segmentation(tmp_path / name)
        assert [(label.label, label.voxels) for label in info.labels] == [(3, 8)]


def test_a_nifti_pair_is_read(tmp_path: Path) -> None:
    labels = np.zeros((4, 4, 5), dtype=np.uint8)
    labels[1:3, 1:3, 1:3] = 3
    sitk.WriteImage(sitk.GetImageFromArray(labels), str(tmp_path / "a.img"))
    for name in ("a.img", "a.hdr"):
        assert [label.voxels for label in describe_segmentation(tmp_path / name).labels] == [8]


@pytest.mark.parametrize("depth", [200, 900, 100_000])
@pytest.mark.parametrize("brackets", ["[]", '{"a":'])
def test_json_nested_without_end(tmp_path: Path, depth: int, brackets: str) -> None:
    path = tmp_path / "a.mrk.json"
    path.write_text(brackets[:-1] * depth if brackets == "[]" else brackets * depth + "1" + "}" * depth)
    refused(read_landmarks, path, "no valid JSON")


@pytest.mark.parametrize(
    ("text", "says"), [('{"a": 1, "a": 2}', "twice"), ("[NaN]", "no number"), ('["\\ud800"]', "surrogate")]
)
def test_json_that_cannot_be_kept(text: str, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        parse_json(text)


def test_descriptions_and_tables_of_any_length_take_no_time(tmp_path: Path) -> None:
    path = tmp_path / "a.mrk.json"
    began = time.process_time()
    for text in ("r=" + "1" * 1_000_000 + "x", "r=5" + " " * 1_000_000 + "y", "r " * 500_000):
        path.write_text(MARKUPS % text)
        assert read_pins(path).radii_mm.tolist() == [10.0]
    table = (b"<Label " + b'Key="1" ' * 120_000).ljust(1_000_000)
    content = bytearray(nifti((8, 8, 8), held=0))
    content[348], content[108:112] = 1, np.float32(352 + len(table)).tobytes()
    (tmp_path / "a.nii").write_bytes(bytes(content) + table + bytes(512))
    assert describe_segmentation(tmp_path / "a.nii").labels == ()
    assert time.process_time() - began < 5


def test_no_length_takes_the_square_of_its_time(tmp_path: Path) -> None:
    """Members of JSON, columns of a batch, labels of landmarks: each took a minute and more."""
    (tmp_path / "a.json").write_text("{" + ",".join(f'"a{k}":0' for k in range(60_000)) + ',"a59999":1}')
    refused(read_box, tmp_path / "a.json", "twice", megabytes=60)
    (tmp_path / "a.csv").write_text(",".join(f"x{k}" for k in range(60_000)) + "\n1\n")
    refused(read_batch, tmp_path / "a.csv", "unknown", megabytes=60)
    names = tuple(f"L{k}" for k in range(100_000))
    marks = Landmarks(np.zeros((len(names), 3)), names)
    began = time.process_time()
    assert paired_landmarks(marks, marks).pairs == tuple(range(len(names)))
    assert time.process_time() - began < 5


def test_short_rows_of_a_long_trajectory(tmp_path: Path) -> None:
    """Each direction was turned by itself, in five times the time; cells as texts took twice the memory."""
    rows = "0,10,20,30,0,0,1\n" * 30_000
    (tmp_path / "a.csv").write_text(f"# frame: ct\ntime_s,x,y,z,dx,dy,dz\n{rows}")
    refused(read_trajectory, tmp_path / "a.csv", "times must rise", megabytes=18)


def test_a_long_line_of_a_ply_header_is_not_taken_apart(tmp_path: Path) -> None:
    line = b"property float x" + b" rot_1" * 150_000
    (tmp_path / "a.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 1\n" + line + b"\nend_header\n1\n")
    refused(read_splat, tmp_path / "a.ply", "not understood", megabytes=7)


def test_counts_that_no_file_holds(tmp_path: Path) -> None:
    head = "ply\nformat %s 1.0\nelement vertex %s\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    for form in ("ascii", "binary_little_endian"):
        for count in ("999999999999", "9" * 5000, "-1", "\u00b2"):
            (tmp_path / "a.ply").write_bytes((head % (form, count)).encode() + b"1 2 3\n")
            refused(read_splat, tmp_path / "a.ply", "truncated|not understood")
    start = b"\x93NUMPY\x01\x00v\x00"
    for shape in ("(999999999999, 3)", "(-1, 3)", "(" * 90, "(1" + ", 1" * 30 + ")", "(" + "9" * 80):
        header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
        (tmp_path / "a.npy").write_bytes(start + header.encode())
        refused(read_points, tmp_path / "a.npy", "save it again|not a plain")


def test_the_header_of_an_array_is_that_of_numpy(tmp_path: Path) -> None:
    for array in (np.zeros(()), np.zeros(5, ">i2"), np.zeros((2, 3), "<f4", order="F"), np.zeros((0, 4, 2), bool)):
        np.save(tmp_path / "a.npy", array)
        header = npy_header((tmp_path / "a.npy").read_bytes())
        assert (header.shape, header.dtype, header.size) == (array.shape, array.dtype, array.nbytes)
        assert header.offset == (tmp_path / "a.npy").stat().st_size - array.nbytes


def test_a_zip_bomb(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.organphys", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("organ.json", b"{}" + b" " * 50_000_000)
    refused(load_asset, tmp_path / "a.organphys", "compressed")


def test_messages_are_one_line_that_can_be_shown() -> None:
    error = InputError("a\nb\x1b[31m\ud800" + "x" * 70_000)
    assert str(error).isprintable() and str(error).startswith("a b") and len(str(error)) <= 1000
    assert one_line("caf\u00e9 5 mm") == "caf\u00e9 5 mm"
