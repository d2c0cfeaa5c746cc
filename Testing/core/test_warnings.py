"""Warnings of a run that goes on: each stands in registration.json and in the report, word for word."""

from __future__ import annotations

import html
import json
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from plyfile import PlyData

from organphys.pipeline.command_line import main
from organphys.pipeline.sample_case import SampleCase, write_sample_case
from organphys.readers.landmarks_file import read_landmarks

EXPECTED = {
    "organ_cut_by_border": "border of the volume",
    "pieces_dropped": "several separate pieces",
    "non_finite_gaussians": "8 of ",
    "landmark_projected": "mm off the organ",
    "single_landmark": "chose its radius",
    "scale_disagrees": "40 mm per scene unit",
    "splat_cleaned": "outliers",
}


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> SampleCase:
    return write_sample_case(tmp_path_factory.mktemp("case"), seed=0, size="small")


def damaged_labels(case: SampleCase, path: Path) -> Path:
    """The organ cut by the lowest slice, and in two pieces."""
    image = sitk.ReadImage(str(case.labels))
    array = sitk.GetArrayFromImage(image)
    along = np.flatnonzero((array == 5).any((0, 1)))
    array[:, :, along[2 * len(along) // 3]] = 0
    cut = sitk.GetImageFromArray(array)
    cut.CopyInformation(image)
    lowest = int(np.flatnonzero((array == 5).any((1, 2)))[0])
    sitk.WriteImage(cut[:, :, lowest + 4 :], str(path))
    return path


def damaged_splat(case: SampleCase, path: Path) -> Path:
    """Eight Gaussians hold numbers that are not finite."""
    splat = PlyData.read(str(case.splat), mmap=False)
    splat["vertex"].data["x"][:7] = np.nan
    splat["vertex"].data["rot_1"][10] = np.inf
    splat.write(str(path))
    return path


def raised_landmark(case: SampleCase) -> str:
    """The first landmark, 30 mm further from the middle of the organ."""
    position = read_landmarks(case.landmarks).positions[0]
    with np.load(case.truth) as truth:
        outwards = position - truth["points_ct"].mean(0)
    raised = position + 30 * outwards / np.linalg.norm(outwards)
    return ",".join(f"{x:.2f}" for x in raised)


def test_warnings_stand_in_the_json_and_in_the_report(case: SampleCase, tmp_path: Path) -> None:
    options = {
        "labels": damaged_labels(case, tmp_path / "labels.nii.gz"),
        "organ": 5,
        "splat": damaged_splat(case, tmp_path / "splat.ply"),
        "landmarks": raised_landmark(case),
        "mm-per-unit": 40,
        "out": tmp_path / "out",
    }
    arguments = [f"--{name}={value}" for name, value in options.items()]
    assert main(["register", *arguments, "--clean", "--quiet"]) == 0
    text = (tmp_path / "out" / "registration.json").read_text()
    assert "NaN" not in text and "Infinity" not in text
    warnings = {warning["code"]: warning["message"] for warning in json.loads(text)["warnings"]}
    page = html.unescape((tmp_path / "out" / "report.html").read_text())
    for code, words in EXPECTED.items():
        assert words in warnings[code]
    assert all(message in page for message in warnings.values())
