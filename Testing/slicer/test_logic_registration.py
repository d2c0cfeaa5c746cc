"""Registrations for real: the logic finds what the command line finds, blocking and in the background alike."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import slicer
from outcome_example import world_points

from organphys.pipeline.evaluation import read_truth
from organphys.readers.landmarks_file import read_landmarks
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.volume_node import asset_of
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs

CASES = Path(__file__).resolve().parents[3] / "shared" / "cases" / "dev"
SAME_MM = 0.05


@pytest.fixture
def logic(scene: object) -> Iterator[OrganPhysRegistrationLogic]:
    made = OrganPhysRegistrationLogic()
    yield made
    made.cleanup()


def loaded_case(folder: Path, organ: int) -> dict[str, Any]:
    """The nodes of a case folder."""
    segmentation = slicer.util.loadSegmentation(str(folder / "ct_labels.nii.gz"))
    content = segmentation.GetSegmentation()
    ids = [name for name in content.GetSegmentIDs() if content.GetSegment(name).GetLabelValue() == organ]
    landmarks = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "Landmarks")
    points = read_landmarks(folder / "landmarks.mrk.json")
    for position, name in zip(points.positions, points.names, strict=True):
        landmarks.AddControlPoint(position.tolist(), name)
    return {"segmentation": segmentation, "segmentID": ids[0], "landmarks": landmarks}


def by_command_line(folder: Path, organ: int, points: np.ndarray, out: Path) -> np.ndarray:
    """Points (N, 3) CT mm as the command line maps them into the scene."""
    np.save(out / "points.npy", points)
    run = [sys.executable, "-m", "organphys"]
    inputs = ["--labels", folder / "ct_labels.nii.gz", "--organ", organ, "--splat", folder / "splat.ply"]
    inputs += ["--landmarks", folder / "landmarks.mrk.json", "--out", out / "result", "--quiet"]
    subprocess.run([*run, "register", *map(str, inputs)], check=True)
    files = ["--points", out / "points.npy", "--out", out / "mapped.npy", "--quiet"]
    subprocess.run([*run, "map", str(out / "result" / "organ.organphys"), *map(str, files)], check=True)
    return np.load(out / "mapped.npy")


def test_command_line_blocking_and_background_runs_agree(
    logic: OrganPhysRegistrationLogic, sample_case: Any, tmp_path: Path
) -> None:
    """All at once here, as three runs of the registration process, and as two commands."""
    truth = read_truth(sample_case.truth)
    nodes, splat = loaded_case(sample_case.folder, sample_case.organ), logic.loadSplat(sample_case.splat)
    case = logic.register(nodes["segmentation"], nodes["segmentID"], splat, landmarksNode=nodes["landmarks"])
    expected = by_command_line(sample_case.folder, sample_case.organ, truth.points_ct, tmp_path)
    blocking = asset_of(case).map_points(truth.points_ct)
    assert np.linalg.norm(blocking - expected, axis=1).max() * truth.mm_per_unit < SAME_MM
    check_transform(case, truth.points_ct, expected)

    inputs = RunInputs(nodes["segmentation"], nodes["segmentID"], splat, landmarks=nodes["landmarks"])
    for stage in ("coarse", "rigid", "elastic"):
        run = logic.startRun(inputs, (stage,))
        logic.waitForRun(run)
        assert run.case.stage == stage and run.case.case_id == case.case_id
    np.testing.assert_allclose(asset_of(run.case).map_points(truth.points_ct), blocking, atol=1e-6)
    check_transform(run.case, truth.points_ct, expected)
    assert [logic.undo().stage for _ in range(3)] == ["rigid", "coarse", "elastic"] and logic.undo() is None


def check_transform(case: Any, points_ct: np.ndarray, points_scene: np.ndarray) -> None:
    """The transform node moves points as the core does, to 0.1 mm."""
    assert case.node("ct_to_scene").GetAttribute("OrganPhys.Transform") == "elastic"
    T_overlay_scene = np.array(case.record["T_overlay_scene"])
    exact = points_scene @ T_overlay_scene[:3, :3].T + T_overlay_scene[:3, 3]
    moved = world_points(case.node("ct_to_scene"), points_ct)
    assert np.linalg.norm(moved - exact, axis=1).max() < 0.1


@pytest.mark.parametrize("name", ["prostate_a"])
def test_dev_case_has_the_command_lines_error(
    host: Any, logic: OrganPhysRegistrationLogic, tmp_path: Path, name: str
) -> None:
    folder = CASES / name
    if not folder.is_dir():
        pytest.skip(f"no case folder {name} beside the repository (shared/cases/dev)")
    truth, organ = read_truth(folder / "truth.npz"), json.loads((folder / "case.json").read_text())["label_id"]
    nodes, splat = loaded_case(folder, organ), logic.loadSplat(folder / "splat.ply")
    case = logic.register(nodes["segmentation"], nodes["segmentID"], splat, landmarksNode=nodes["landmarks"])
    expected = by_command_line(folder, organ, truth.points_ct, tmp_path)
    found = asset_of(case).map_points(truth.points_ct)
    errors = [np.linalg.norm(at - truth.points_scene, axis=1).mean() * truth.mm_per_unit for at in (found, expected)]
    print(f"{name}: mean TRE {errors[0]:.4f} mm by the logic, {errors[1]:.4f} mm by the command line")
    assert abs(errors[0] - errors[1]) < SAME_MM
