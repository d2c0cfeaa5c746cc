"""Bad inputs: one plain sentence that says what to do, before a run or from it, and never an exception dialog."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import outcome_example as example
import pytest
import slicer

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.choices import CameraChoice, Method, SkinningWeights, Stiffness, UnitChoice
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs, inputs_from_parameters


@pytest.fixture
def logic(scene: object) -> Iterator[OrganPhysRegistrationLogic]:
    made = OrganPhysRegistrationLogic()
    yield made
    made.cleanup()


@pytest.fixture
def parameters(scene: object) -> SimpleNamespace:
    """Names and values of the parameter node, all well."""
    segmentation = example.segmentation_node(scene)
    return SimpleNamespace(
        segmentation=segmentation,
        segmentID=segmentation.GetSegmentation().GetNthSegmentID(0),
        splat=example.splat_node(scene),
        landmarks=None,
        roi=None,
        landmarkRadiusMm=0.0,
        cameraChoice=CameraChoice.SceneOrigin,
        cameraPosition="",
        cameraFovDeg=0.0,
        unitChoice=UnitChoice.Unknown,
        mmPerUnit=1.0,
        unitPercent=0.0,
        method=Method.OrganPhys,
        stiffness=Stiffness.Moderate,
        weights=SkinningWeights.Rkpm,
        opacity=0.1,
        removeFloaters=False,
        closeHoles=False,
        opening=True,
        seed=0,
    )


def empty_segment(scene: Any) -> tuple[Any, str]:
    node = scene.AddNewNodeByClass("vtkMRMLSegmentationNode", "Painted")
    return node, node.GetSegmentation().AddEmptySegment("liver", "liver")


def test_good_inputs_have_no_problem(logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace) -> None:
    assert logic.problems(parameters) == []


def test_an_empty_panel_names_what_to_choose_first(
    logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace
) -> None:
    parameters.segmentation, parameters.segmentID, parameters.splat = None, "", None
    organ, splat = logic.problems(parameters)
    assert "choose the segmentation" in organ and "load the Gaussian splat" in splat


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"segmentID": ""}, "no segment chosen; choose the organ's segment"),
        ({"segmentID": "gone"}, "choose the organ again"),
        ({"splat": None}, "load the Gaussian splat"),
        ({"opacity": 0.95}, "lower the threshold"),
        ({"cameraChoice": CameraChoice.FromView}, "no view taken yet"),
        ({"cameraChoice": CameraChoice.FromView, "cameraPosition": "[1, 2]"}, "take the view again"),
        ({"cameraChoice": CameraChoice.FromView, "cameraPosition": "[1, 2, NaN]"}, "not finite"),
        ({"cameraChoice": CameraChoice.FromView, "cameraPosition": "nonsense"}, "take the view again"),
        ({"unitChoice": UnitChoice.Custom, "mmPerUnit": 0.0}, "choose unknown"),
        ({"method": Method.Paper}, "needs a landmark"),
    ],
)
def test_each_problem_says_what_to_do(
    logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace, changes: dict[str, Any], words: str
) -> None:
    vars(parameters).update(changes)
    [problem] = logic.problems(parameters)
    assert words in problem and problem[0].isupper() and problem.endswith(".")


def test_an_empty_segment(logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace, scene: Any) -> None:
    parameters.segmentation, parameters.segmentID = empty_segment(scene)
    [problem] = logic.problems(parameters)
    assert "empty" in problem and "paint the organ" in problem


def test_a_model_is_no_splat(logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace, scene: Any) -> None:
    parameters.splat = scene.AddNewNodeByClass("vtkMRMLModelNode", "Mesh")
    [problem] = logic.problems(parameters)
    assert "Mesh" in problem and ".ply" in problem


def test_a_splat_without_opacity(logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace) -> None:
    parameters.splat.GetPolyData().GetPointData().RemoveArray("opacity")
    [problem] = logic.problems(parameters)
    assert "load" in problem and ".ply" in problem


def test_a_region_of_interest_that_is_not_placed(
    logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace, scene: Any
) -> None:
    parameters.roi = scene.AddNewNodeByClass("vtkMRMLMarkupsROINode", "Crop")
    [problem] = logic.problems(parameters)
    assert "Crop" in problem and "draw it" in problem


def test_values_reach_the_core_by_its_own_names(parameters: SimpleNamespace) -> None:
    parameters.cameraChoice, parameters.cameraPosition, parameters.cameraFovDeg = (
        CameraChoice.FromView,
        "[1, 2, 3]",
        70.0,
    )
    parameters.unitChoice, parameters.unitPercent, parameters.landmarkRadiusMm = UnitChoice.Centimetre, 5.0, 40.0
    inputs = inputs_from_parameters(parameters)
    assert (inputs.camera_position, inputs.camera_fov_deg) == ((1.0, 2.0, 3.0), 70.0)
    assert (inputs.mm_per_unit, inputs.unit_percent, inputs.landmark_radius_mm) == (10.0, 5.0, 40.0)
    assert (inputs.method, inputs.stiffness, inputs.weights) == ("organphys", "moderate", "rkpm")
    parameters.cameraChoice, parameters.unitChoice, parameters.landmarkRadiusMm = (
        CameraChoice.SceneOrigin, UnitChoice.Unknown, 0.0
    )  # fmt: skip
    inputs = inputs_from_parameters(parameters)
    assert (inputs.camera_position, inputs.camera_fov_deg, inputs.mm_per_unit) == (None, None, None)
    assert inputs.landmark_radius_mm is None


def run_fails(host: Any, logic: OrganPhysRegistrationLogic, inputs: RunInputs) -> str:
    """Message of a run that the real process refuses."""
    failed: list[tuple[str, str]] = []
    run = logic.startRun(inputs, onFailed=lambda code, message: failed.append((code, message)))
    host.wait_until(lambda: run is None or run.finished, timeout=60)
    [(code, message)] = failed
    assert code == "input" and message[0].isupper() and message.endswith(".")
    return message


def with_landmark(inputs: RunInputs, position: np.ndarray) -> RunInputs:
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "Landmarks")
    node.AddControlPoint(position.tolist(), "tip")
    return replace(inputs, landmarks=node)


def test_what_only_the_process_can_see_is_told_and_leaves_nothing(
    host: Any, logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace, scene_contents: Callable
) -> None:
    """A landmark far from the organ, an ROI without splat, an organ of a few voxels; one process for all."""
    inputs = inputs_from_parameters(parameters)
    far = with_landmark(inputs, example.organ().vertices.max(0) + 200)
    crop = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsROINode", "Crop")
    crop.SetXYZ(9e4, 9e4, 9e4)
    crop.SetSize(1, 1, 1)
    middle = example.organ().vertices.mean(0)
    tiny = example.segmentation_node(
        slicer.mrmlScene, "Tiny", lambda points: np.linalg.norm(points - middle, axis=1) < 7
    )
    before = scene_contents()
    assert "tip lies" in run_fails(host, logic, far).replace("Landmark tip", "tip")
    assert "region of interest" in run_fails(host, logic, replace(inputs, roi=crop)).lower()
    tiny_id = tiny.GetSegmentation().GetNthSegmentID(0)
    assert "voxels" in run_fails(host, logic, replace(inputs, segmentation=tiny, segment_id=tiny_id, opening=False))
    assert scene_contents() == before


def test_the_blocking_call_raises_the_same_words(
    logic: OrganPhysRegistrationLogic, parameters: SimpleNamespace, scene_contents: Callable
) -> None:
    before = scene_contents()
    with pytest.raises(InputError, match="no segment chosen"):
        logic.register(parameters.segmentation, "", parameters.splat)
    with pytest.raises(InputError, match="neighbours of coarse, rigid, elastic"):
        logic.register(parameters.segmentation, parameters.segmentID, parameters.splat, stages=("coarse", "elastic"))
    assert scene_contents() == before


def test_a_file_that_is_no_splat_is_refused(
    logic: OrganPhysRegistrationLogic, tmp_path: Path, scene_contents: Callable
) -> None:
    before, path = scene_contents(), tmp_path / "notes.ply"
    path.write_text("not a splat")
    with pytest.raises(InputError):
        logic.loadSplat(path)
    assert scene_contents() == before
