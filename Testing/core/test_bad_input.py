"""Bad input to the command: one line on stderr that says what to do, exit code 2, nothing written.

Output is captured at the file descriptors, where the C and C++ libraries print too.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from organphys.pipeline.command_line import main
from organphys.pipeline.sample_case import SampleCase, write_sample_case

PLY = "ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{fields}end_header\n"
XYZ = "property float x\nproperty float y\nproperty float z\n"
Change = Callable[[SampleCase, Path], dict[str, str]]


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> SampleCase:
    return write_sample_case(tmp_path_factory.mktemp("case"), seed=0, size="small")


def error_line(capture: pytest.CaptureFixture[str], case: SampleCase, out: Path, options: dict[str, str]) -> str:
    """The one line of a command that ends with code 2, progress lines left out."""
    values = {"labels": str(case.labels), "organ": "5", "splat": str(case.splat), "out": str(out)} | options
    code = main(["register", *(f"--{name}={value}" for name, value in values.items())])
    captured = capture.readouterr()
    assert code == 2 and captured.out == "", captured.err
    lines = [line for line in captured.err.splitlines() if not re.match(r"organphys: +[\d.]+ s ", line)]
    assert len(lines) == 1 and lines[0].startswith("organphys: error: "), captured.err
    return lines[0]


def file(name: str, content: bytes | str, option: str) -> Change:
    """A changed option: a file with this content."""

    def change(case: SampleCase, folder: Path) -> dict[str, str]:
        (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return {option: str(folder / name)}

    return change


def labels(name: str, edit: Callable[[np.ndarray], np.ndarray], *, cut: float = 1.0, noise: int = 0) -> Change:
    """The case's label map, edited, written under ``name``, and then cut, or its last bytes overwritten with noise."""

    def change(case: SampleCase, folder: Path) -> dict[str, str]:
        image = sitk.ReadImage(str(case.labels))
        edited = sitk.GetImageFromArray(edit(sitk.GetArrayFromImage(image)))
        edited.SetSpacing(image.GetSpacing())
        sitk.WriteImage(edited, str(folder / name), useCompression=True)
        content = (folder / name).read_bytes()
        content = content[: int(cut * len(content))]
        if noise:
            content = content[:-noise] + np.random.default_rng(0).bytes(noise)
        (folder / name).write_bytes(content)
        return {"labels": str(folder / name)}

    return change


def splat(edit: Callable[[bytes], bytes]) -> Change:
    def change(case: SampleCase, folder: Path) -> dict[str, str]:
        (folder / "s.ply").write_bytes(edit(case.splat.read_bytes()))
        return {"splat": str(folder / "s.ply")}

    return change


def points(coordinates: np.ndarray) -> Change:
    content = PLY.format(count=len(coordinates), fields=XYZ).encode() + coordinates.astype("<f4").tobytes()
    return file("points.ply", content, "splat")


def few_voxels(array: np.ndarray) -> np.ndarray:
    few = np.zeros_like(array)
    few[30:32, 25:27, 30:33] = 5
    return few


MARKUP = '{"markups":[{"type":"Fiducial","coordinateSystem":"LPS","controlPoints":[%s]}]}'
LINE = np.linspace(0, 1, 300)[:, None] * [0.0, 0.0, 1.0] + [0.0, 0.0, 5.0]

BAD: dict[str, tuple[Change | dict[str, str], str]] = {
    "label not in the map": ({"organ": "77"}, "give one that is present: 4 (.* ml), 5 (.* ml)"),
    "background": ({"organ": "0"}, "above 0"),
    "bare name": ({"organ": "liver"}, "--label-scheme .* present: 4 (.* ml), 5 (.* ml)"),
    "unknown scheme": ({"organ": "liver", "label-scheme": "foo"}, "expected one of totalsegmentator"),
    "organ of the scheme not there": ({"organ": "spleen", "label-scheme": "totalsegmentator"}, "not in the map"),
    "empty mask": (labels("zero.nii.gz", np.zeros_like), "every voxel is 0; give"),
    "twelve voxels": (labels("few.nii.gz", few_voxels), "only 12 voxels .* use a finer label map"),
    "an image": (labels("image.nii.gz", lambda a: a * np.float32(0.3)), "give its label map"),
    "cut .mha": (labels("cut.mha", np.copy, cut=0.7), "damaged or truncated.*copy the file again"),
    "cut .nrrd": (labels("cut.nrrd", np.copy, cut=0.7), "damaged or truncated.*copy the file again"),
    "cut .nii.gz": (labels("cut.nii.gz", np.copy, cut=0.7), "copy the file again"),
    "damaged .nii.gz": (labels("damaged.nii.gz", np.copy, noise=8), "copy the file again"),
    "damaged .mha": (labels("damaged.mha", np.copy, noise=1000), "damaged or truncated.*copy the file again"),
    "empty label map": (file("e.nii.gz", b"", "labels"), "is empty"),
    "DICOM": (file("seg.dcm", bytes(128) + b"DICM" + bytes(99), "labels"), "segimage2itkimage"),
    "labels are a folder": ({"labels": "."}, "this is a folder"),
    "truncated PLY": (splat(lambda b: b[: len(b) // 2]), "truncated.*copy or export"),
    "PLY without x": (splat(lambda b: b.replace(b"float x", b"float q", 1)), "have no x"),
    "PLY without header": (splat(lambda b: b[b.index(b"end_header") + 11 :]), "export the splat as PLY"),
    "empty PLY": (splat(lambda b: b""), "is empty"),
    "PLY of nothing": (points(np.zeros((0, 3))), "no vertices"),
    "splat is a folder": ({"splat": "."}, "this is a folder"),
    "one point": (points(np.ones((1, 3))), "line or point; check"),
    "all in one place": (points(np.ones((300, 3))), "line or point; check"),
    "all on a line": (points(LINE), "line or point; check"),
    "three points": (points(np.add(np.eye(3), 5)), "only 3 opaque Gaussians form a surface; lower"),
    "fifty points": (points(np.random.default_rng(0).normal(9, 1, size=(50, 3))), "form a surface; lower"),
    "nothing opaque": ({"opacity": "0.99999"}, "threshold 0.99999 .*lower it"),
    "no landmark": (file("l.mrk.json", MARKUP % "", "landmarks"), "place at least one point"),
    "landmark of two numbers": (file("l.mrk.json", MARKUP % '{"position":[1,2]}', "landmarks"), "save .* again"),
    "landmark of words": (file("l.fcsv", "1,a,b\n", "landmarks"), "save .* again"),
    "malformed landmarks": (file("l.mrk.json", '{"markups":[', "landmarks"), "no valid JSON.*save the file again"),
    "landmark far away": ({"landmarks": "900,0,0"}, "landmark 1 lies [0-9]+ mm from the organ"),
    "landmarks are a folder": ({"landmarks": "."}, "this is a folder"),
    "malformed ROI": (file("r.json", "[1", "roi"), "no valid JSON"),
    "empty ROI": (file("r.json", '{"center":[0,0,-99],"size":[1,1,1]}', "roi"), "no opaque Gaussian; check"),
    "ROI of two numbers": (file("r.json", '{"center":[0,0,0],"size":[1,1]}', "roi"), "3 finite numbers"),
    "ROI without extent": (file("r.json", '{"center":[0,0,0],"size":[1,0,1]}', "roi"), "above 0"),
    "unit of words": ({"mm-per-unit": "abc"}, "S or S:P"),
    "negative unit": ({"mm-per-unit": "-3"}, "above 0"),
    "unit too uncertain": ({"mm-per-unit": "25:500"}, "0 to 100 percent"),
    "absurd unit": ({"mm-per-unit": "1e-300"}, "expected 1e-06"),
    "field of view": ({"fov": "400"}, "below 180 degrees"),
    "seed": ({"seed": "-1"}, "at least 0"),
    "paper without landmarks": ({"method": "paper"}, "--landmarks"),
    "no folder named": ({"out": ""}, "name a folder"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input(case: SampleCase, tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str) -> None:
    change, says = BAD[name]
    options = change if isinstance(change, dict) else change(case, tmp_path)
    capfd.readouterr()  # what writing the files printed
    line = error_line(capfd, case, tmp_path / "made" / "out", options)
    assert re.search(says.replace("(", r"\(").replace(")", r"\)"), line), line
    assert not (tmp_path / "made").exists()


def test_an_output_folder_below_a_file(case: SampleCase, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("in the way")
    assert "choose another output folder" in error_line(capfd, case, tmp_path / "file" / "out", {})


def test_an_older_result_survives_an_error(case: SampleCase, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    older = {name: f"older {name}" for name in ("organ.organphys", "registration.json")}
    for name, text in older.items():
        (tmp_path / name).write_text(text)
    error_line(capfd, case, tmp_path, {"organ": "77"})
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == older


def test_a_camera_that_is_no_position(case: SampleCase, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    options = ["--labels", str(case.labels), "--organ", "5", "--splat", str(case.splat), "--out", str(tmp_path / "out")]
    assert main(["register", *options, "--camera", "nan", "0", "0"]) == 2
    assert "camera position: expected three finite numbers" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
