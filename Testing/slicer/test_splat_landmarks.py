"""Landmarks placed on the splat: scene units, pairs with the organ's, kept on the splat, watched while live."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import outcome_example as example
import pytest

from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, matrix_of
from OrganPhysRegistrationLib.inputs.splat_landmarks import case_landmarks, keep_on_splat, same_places
from OrganPhysRegistrationLib.inputs.splat_node import T_shown_scene, scene_to_world, splat_arrays
from OrganPhysRegistrationLib.inputs.splat_scale import set_scale
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.case_nodes import write_outcome
from OrganPhysRegistrationLib.panel.splat_landmarks_section import SplatLandmarksSection
from OrganPhysRegistrationLib.runs.gathered_case import gather
from OrganPhysRegistrationLib.runs.live_updates import PLACES, LiveCallbacks, LiveUpdates
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs
from OrganPhysRegistrationLib.runs.run_manager import RunManager
from OrganPhysRegistrationLib.runs.stepped_work import run_at_once


@pytest.fixture(autouse=True)
def no_child_process(monkeypatch):
    """Nothing is registered here."""
    monkeypatch.setattr(OrganPhysRegistrationLogic, "warmUp", lambda self: None)


@pytest.fixture
def splat(scene):
    """At 20 mm per unit, under a turned parent."""
    node, pose = example.splat_node(scene), np.eye(4)
    set_scale(node, 20.0)
    pose[:3, :3], pose[:3, 3] = rotation_about(np.array([0.0, 1.0, 0.3]), -0.5), [10, 5, 0]
    parent = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode")
    parent.SetMatrixTransformToParent(matrix_of(pose))
    scene_to_world(node).SetAndObserveTransformNodeID(parent.GetID())
    return node


@pytest.fixture
def places(splat):
    """Two Gaussians' centres (2, 3), raw scene units."""
    return splat_arrays(splat).centres[[3, 400]].astype(float)


def point_list(scene, name, points, labels=("Landmark 1", "Landmark 2", "Landmark 3")):
    node = scene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", name)
    for point, label in zip(points, labels, strict=False):
        node.AddControlPoint(list(map(float, point)), label)
    return node


@pytest.fixture
def on_organ(scene):
    return point_list(scene, "On the organ", example.organ().vertices[[0, 50]])


@pytest.fixture
def on_splat(scene, splat, places):
    return point_list(scene, "On the splat", apply_matrix(T_shown_scene(splat), places))


@pytest.fixture
def inputs(scene, splat, on_organ, on_splat):
    segmentation = example.segmentation_node(scene)
    segment = segmentation.GetSegmentation().GetNthSegmentID(0)
    return RunInputs(segmentation, segment, splat, landmarks=on_organ, splat_landmarks=on_splat)


def problem(module, inputs):
    found = module.logic.problems(inputs)
    assert len(found) <= 1
    return found[0] if found else ""


def test_places_reach_the_core_in_scene_units(inputs, on_splat, places):
    found = run_at_once(gather(inputs)).landmarks
    np.testing.assert_allclose(found.points_scene, places, rtol=1e-9)
    np.testing.assert_allclose(found.points_ct, example.organ().vertices[[0, 50]])
    assert found.pairs == (0, 1)
    on_splat.RemoveAllControlPoints()  # chosen, but nothing is placed yet
    assert run_at_once(gather(inputs)).landmarks.points_scene is None


def test_labels_lead_and_only_the_first_two_landmarks_count(scene, splat, on_organ, on_splat, places):
    on_splat.SetNthControlPointLabel(0, "Landmark 2")
    on_splat.SetNthControlPointLabel(1, "Landmark 1")
    found = case_landmarks(on_organ, on_splat, splat)
    assert found.pairs == (1, 0)
    on_organ.AddControlPoint([0, 0, 0], "third")
    on_splat.SetNthControlPointLabel(1, "third")
    found = case_landmarks(on_organ, on_splat, splat)
    assert (len(found.points_ct), found.pairs) == (2, (1,))
    np.testing.assert_allclose(found.points_scene, places[:1], rtol=1e-9)


def test_points_go_along_when_the_splat_is_shown_at_another_scale(splat, on_organ, on_splat, places):
    before = case_landmarks(on_organ, on_splat, splat)
    keep_on_splat(on_splat, splat)
    keep_on_splat(on_splat, splat)
    np.testing.assert_allclose(case_landmarks(on_organ, on_splat, splat).points_scene, places, rtol=1e-9)
    set_scale(splat, 31.0, "registered")
    after = case_landmarks(on_organ, on_splat, splat)
    np.testing.assert_allclose(after.points_scene, places, rtol=1e-9)
    assert same_places(before, after) and same_places(None, None)
    on_splat.SetNthControlPointPositionWorld(0, 0, 0, 0)
    assert not same_places(before, case_landmarks(on_organ, on_splat, splat))
    assert not same_places(before, case_landmarks(on_organ, None, splat))


def test_what_does_not_fit_is_a_problem_told_before_the_run(module, inputs, on_organ, on_splat):
    assert problem(module, inputs) == ""
    on_splat.AddControlPoint([0, 0, 0], "third")
    assert "3 for 2 landmarks" in problem(module, inputs)
    assert "no landmarks" in problem(module, replace(inputs, landmarks=None))
    assert "choose another list" in problem(module, replace(inputs, splat_landmarks=on_organ))
    with pytest.raises(InputError, match="3 for 2"):
        module.logic.register(
            inputs.segmentation, inputs.segment_id, inputs.splat, landmarksNode=on_organ, splatLandmarksNode=on_splat
        )


def test_the_panel_keeps_the_chosen_list_on_the_splat(host, module, inputs, on_organ, on_splat, screenshot):
    chosen = {"segmentation": inputs.segmentation, "segmentID": inputs.segment_id, "splat": inputs.splat}
    module.widget.panel.choose({**chosen, "landmarks": on_organ, "splatLandmarks": on_splat})
    host.process()
    assert on_splat.GetParentTransformNode() is scene_to_world(inputs.splat)
    assert module.ui.splatLandmarksSelector.currentNode() is on_splat
    assert module.ui.applyButton.enabled and not module.ui.addSplatLandmarksButton.visible
    screenshot(module.panel, "panel_splat_landmarks")
    on_splat.AddControlPoint([0, 0, 0], "third")
    host.process()
    assert not module.ui.applyButton.enabled and "3 for 2 landmarks" in module.ui.reasonLabel.text
    module.ui.splatLandmarksSelector.setCurrentNode(None)
    host.process()
    assert module.ui.applyButton.enabled


def test_place_makes_a_list_of_its_own(host, module):
    module.ui.addSplatLandmarksButton.click()
    parameters = module.widget.panel.parameters
    assert parameters.splatLandmarks is not None and parameters.landmarks is None
    assert module.ui.splatLandmarksPlaceWidget.placeModeEnabled
    module.panel.exit()
    assert not module.ui.splatLandmarksPlaceWidget.placeModeEnabled
    assert any(isinstance(section, SplatLandmarksSection) for section in module.widget.panel.sections)


class Child:
    """Stands for the registration process and its session: takes every request, answers none."""

    def __init__(self):
        self.process, self.generation, self.running, self.registered, self.busy = self, 1, True, True, False

    def request(self, *_, **__):
        pass

    def cancel(self, *_):
        pass

    def detached(self):
        pass


@pytest.fixture
def case(inputs):
    return write_outcome(
        example.outcome(), segmentation=inputs.segmentation, segment_id=inputs.segment_id, splat=inputs.splat
    )


def test_live_update_ends_with_a_plain_word_when_a_place_moves(inputs, case, on_organ, on_splat):
    ended = []
    live = LiveUpdates(Child(), inputs, case, LiveCallbacks(ended=ended.append))
    on_organ.SetNthControlPointPositionWorld(0, 1, 2, 3)
    set_scale(inputs.splat, 20.0)
    assert live.state != "off"
    on_splat.SetNthControlPointPositionWorld(0, 0, 0, 0)
    assert (live.state, ended) == ("off", [PLACES])


def test_live_update_ends_when_the_counts_do_not_match_any_more(inputs, case, on_splat):
    ended = []
    live = LiveUpdates(Child(), inputs, case, LiveCallbacks(ended=ended.append))
    on_splat.AddControlPoint([0, 0, 0], "third")
    assert live.state == "off" and "3 for 2 landmarks" in ended[0]


def test_live_update_needs_the_places_that_were_registered(inputs, case, on_splat):
    manager = RunManager(Child())
    manager._session = Child()
    registered = case_landmarks(inputs.landmarks, on_splat, inputs.splat)
    manager._run_ended(SimpleNamespace(case=case, undo=object(), inputs=inputs, landmarks=registered))
    manager._undos.clear()
    manager.start_live(inputs, LiveCallbacks()).stop()
    on_splat.SetNthControlPointPositionWorld(0, 0, 0, 0)
    with pytest.raises(InputError, match="register this organ"):
        manager.start_live(inputs, LiveCallbacks())
