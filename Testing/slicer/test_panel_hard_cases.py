"""Inputs and turns of events that a panel meets in practice: units taken back, things deleted, nonsense entered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import slicer
from outcome_example import outcome, segmentation_node, splat_node

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.choices import CameraChoice, UnitChoice
from OrganPhysRegistrationLib.inputs.matrices import to_parent
from OrganPhysRegistrationLib.inputs.segment_input import segment_mask
from OrganPhysRegistrationLib.inputs.splat_node import load_splat, mm_per_unit_of, scene_to_world
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.case_nodes import write_outcome
from OrganPhysRegistrationLib.outputs.case_record import CaseNodes
from OrganPhysRegistrationLib.outputs.follow_splat import follow_splat
from OrganPhysRegistrationLib.outputs.geometry import points_of
from OrganPhysRegistrationLib.outputs.overlay_frame import T_overlay_ct
from OrganPhysRegistrationLib.runs.core_in_use import CoreInUse
from OrganPhysRegistrationLib.runs.result_nodes import write_case
from OrganPhysRegistrationLib.runs.run_inputs import RunInputs


@pytest.fixture(autouse=True)
def no_child_process(monkeypatch):
    """The registration process is not started ahead of a run: nothing runs here."""
    monkeypatch.setattr(OrganPhysRegistrationLogic, "warmUp", lambda self: None)


@pytest.fixture
def parameters(module):
    return module.widget.panel.parameters


@pytest.fixture
def nodes(host, module, scene):
    """A segment and a splat in the panel."""
    segmentation = segmentation_node(scene)
    chosen = {
        "segmentation": segmentation,
        "segmentID": segmentation.GetSegmentation().GetNthSegmentID(0),
        "splat": splat_node(scene),
    }
    module.widget.panel.choose(chosen)
    host.process()
    return chosen


@pytest.fixture
def case(host, module, nodes):
    """The finished case of these nodes."""
    made = write_outcome(
        outcome(notices=(("partial_view", "Only a part of the organ is seen."),)),
        segmentation=nodes["segmentation"],
        segment_id=nodes["segmentID"],
        splat=nodes["splat"],
    )
    module.widget.panel.adopt(made)
    host.process()
    return made


def test_a_unit_taken_back_is_a_guess_again(host, parameters, nodes):
    guessed = mm_per_unit_of(nodes["splat"])
    assert guessed[1] == "guess"
    parameters.unitChoice = UnitChoice.Metre
    host.process()
    assert mm_per_unit_of(nodes["splat"]) == (1000.0, "stated", 0.0)
    parameters.unitChoice = UnitChoice.Unknown
    host.process()
    scale, kind, _ = mm_per_unit_of(nodes["splat"])
    assert kind == "guess" and scale < 500


def test_results_follow_the_unit_and_go_back_to_the_registered_scale(host, parameters, nodes, case):
    before = points_of(case.node("surface_elastic").GetPolyData())
    registered = case.record["mm_per_unit"]
    parameters.mmPerUnit, parameters.unitChoice = 2 * registered, UnitChoice.Custom
    host.process()
    np.testing.assert_allclose(points_of(case.node("surface_elastic").GetPolyData()), 2 * before, rtol=1e-4, atol=1e-3)
    assert not follow_splat(case)
    parameters.unitChoice = UnitChoice.Unknown
    host.process()
    assert mm_per_unit_of(nodes["splat"])[:2] == (pytest.approx(registered), "registered")
    np.testing.assert_allclose(points_of(case.node("surface_elastic").GetPolyData()), before, rtol=1e-4, atol=1e-3)


def test_a_unit_stated_in_a_script_shows_the_splat_in_mm(scene):
    segmentation, splat = segmentation_node(scene), splat_node(scene)
    stated = outcome(unit_stated=True)
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    made = write_outcome(stated, segmentation=segmentation, segment_id=segment_id, splat=splat)
    assert np.linalg.det(T_overlay_ct(made)[:3, :3]) == pytest.approx(1)


def test_a_changed_unit_ends_the_adjustment_by_hand(host, module, parameters, case):
    module.ui.adjustPoseButton.click()
    host.process()
    assert module.ui.continuePoseButton.enabled
    parameters.unitChoice = UnitChoice.Metre
    host.process()
    assert not module.ui.continuePoseButton.enabled and not module.ui.adjustPoseButton.checked


@pytest.mark.parametrize("entered", [0.0, 1e9])
def test_an_absurd_unit_cannot_be_entered(host, module, parameters, nodes, entered):
    parameters.unitChoice = UnitChoice.Custom
    host.process()
    module.ui.mmPerUnitSpinBox.setValue(entered)
    host.process()
    assert 1e-4 <= parameters.mmPerUnit <= 1e6
    assert module.ui.applyButton.enabled


def test_a_splat_loaded_with_an_absurd_unit_is_told(host, module, parameters, nodes, sample_case):
    parameters.splat = load_splat(sample_case.splat, mm_per_unit=1e-6, percent=80)
    host.process()
    assert "state its unit" in module.ui.messageLabel.text
    assert parameters.unitChoice is UnitChoice.Unknown


def test_an_uncertain_unit_comes_along(host, parameters, nodes, sample_case):
    parameters.splat = load_splat(sample_case.splat, mm_per_unit=10, percent=80)
    host.process()
    assert (parameters.unitChoice, parameters.mmPerUnit, parameters.unitPercent) == (UnitChoice.Custom, 10.0, 80.0)


def test_an_empty_segment_in_a_shared_label_map_is_told_beforehand(host, module, parameters, sample_case):
    loaded = module.logic.loadSampleCase(folder=sample_case.folder, size="small")
    module.widget.panel.choose(loaded)
    parameters.segmentID = loaded["segmentation"].GetSegmentation().AddEmptySegment("", "empty")
    host.process()
    assert not module.ui.applyButton.enabled
    assert "paint the organ" in module.ui.reasonLabel.text
    assert not module.ui.messageLabel.visible


def test_a_region_that_leaves_nothing_is_told_beforehand(host, module, parameters, nodes):
    roi = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsROINode")
    roi.SetCenter(5000, 5000, 5000)
    roi.SetSize(10, 10, 10)
    parameters.roi = roi
    host.process()
    assert not module.ui.applyButton.enabled
    assert "leaves 0 Gaussians" in module.ui.reasonLabel.text
    slicer.mrmlScene.RemoveNode(roi)
    host.process()
    assert module.ui.applyButton.enabled


def test_a_camera_that_cannot_be_read_is_told(host, module, parameters, nodes):
    parameters.cameraPosition, parameters.cameraChoice = "rubbish", CameraChoice.FromView
    host.process()
    assert not module.ui.applyButton.enabled
    assert "take the view again" in module.ui.reasonLabel.text
    module.ui.endoscopeViewButton.click()
    assert "take the view again" in module.ui.messageLabel.text


def test_a_section_that_fails_leaves_the_others_alive(host, module, nodes, monkeypatch):
    def fail() -> None:
        raise RuntimeError("broken")

    monkeypatch.setattr(module.widget.panel.sections[0], "refresh", fail)
    nodes["segmentation"].GetSegmentation().RemoveSegment(nodes["segmentID"])
    host.process()
    assert "broken" in module.ui.messageLabel.text
    assert "choose the organ" in module.ui.reasonLabel.text


def test_a_deleted_splat_takes_its_own_transform_along(host, module, nodes, case, sample_case):
    transform = scene_to_world(nodes["splat"])
    other = load_splat(sample_case.splat)
    kept = scene_to_world(other)
    slicer.mrmlScene.RemoveNode(nodes["splat"])
    host.process()
    assert not slicer.mrmlScene.IsNodePresent(transform)
    assert slicer.mrmlScene.IsNodePresent(kept) and other.GetParentTransformNode() is kept
    assert slicer.mrmlScene.IsNodePresent(case.node("surface_elastic"))


def test_warnings_belong_to_the_organ_that_is_shown(host, module, parameters, nodes, case):
    other = nodes["segmentation"].GetSegmentation().AddEmptySegment("", "other")
    parameters.segmentID = other
    host.process()
    assert not module.ui.messageLabel.visible
    parameters.segmentID = nodes["segmentID"]
    host.process()
    assert "Only a part" in module.ui.messageLabel.text


def test_messages_go_with_the_scene_and_warnings_come_back_with_it(host, module, nodes, case, tmp_path):
    module.widget.panel.tell("Done in 3 s.", "good")
    assert slicer.util.saveScene(str(tmp_path / "scene.mrb"))
    slicer.mrmlScene.Clear(0)
    host.process()
    assert not module.ui.messageLabel.visible
    slicer.util.loadScene(str(tmp_path / "scene.mrb"))
    host.process()
    assert "Only a part" in module.ui.messageLabel.text


def test_a_scene_closed_during_an_adjustment_by_hand(host, module, case):
    module.ui.adjustPoseButton.click()
    host.process()
    slicer.mrmlScene.Clear(0)
    host.process()
    assert not module.ui.adjustPoseButton.checked and not module.ui.continuePoseButton.enabled
    assert not module.ui.messageLabel.visible


def test_another_copy_of_the_core_is_told_beside_the_button(host, module, nodes, monkeypatch):
    stranger = CoreInUse("0.0.1", "/elsewhere/organphys/__init__.py", own=False)
    monkeypatch.setattr(module.logic, "organphysInUse", lambda: stranger)
    module.widget.panel.refresh()
    assert "Another copy of organphys" in module.ui.reasonLabel.text
    assert module.ui.applyButton.enabled


def test_an_organ_mirrored_by_its_parent_transform_is_told(host, module, nodes):
    mirror = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLLinearTransformNode", "mirror")
    mirror.SetMatrixTransformToParent(slicer.util.vtkMatrixFromArray(np.diag([-1.0, 1, 1, 1])))
    nodes["segmentation"].SetAndObserveTransformNodeID(mirror.GetID())
    module.widget.panel.refresh()
    assert not module.ui.applyButton.enabled
    assert "mirrors or flattens" in module.ui.reasonLabel.text
    with pytest.raises(InputError, match="mirrors"):
        segment_mask(nodes["segmentation"], nodes["segmentID"])
    mirror.SetMatrixTransformToParent(slicer.util.vtkMatrixFromArray(np.diag([-1.0, -1, 1, 1])))
    module.widget.panel.refresh()
    assert module.ui.applyButton.enabled


@pytest.fixture
def second(host, module, nodes, case):
    """A second organ on the same splat, registered to another pose; the panel shows it."""
    segment_id = nodes["segmentation"].GetSegmentation().AddEmptySegment("", "second")
    moved = outcome()
    shift = np.eye(4)
    shift[:3, 3] = (0.3, 0, 0)
    moved = replace(moved, similarities={stage: shift @ T for stage, T in moved.similarities.items()})
    inputs = RunInputs(nodes["segmentation"], segment_id, nodes["splat"])
    written = write_case(moved, inputs)
    module.logic._runs.remember(written.case, written.undo)
    module.widget.panel.choose({"segmentID": segment_id})
    host.process()
    return written.case


def test_undo_of_another_organs_run_keeps_the_shown_result(host, module, parameters, nodes, case, second):
    parameters.segmentID = nodes["segmentID"]
    host.process()
    module.ui.undoButton.click()
    host.process()
    assert CaseNodes.all() == [case]
    assert module.widget.panel.case() == case and module.ui.stageElasticButton.enabled


def test_the_organ_that_is_chosen_lies_in_the_ct(host, module, parameters, nodes, case, second):
    module.ui.overlayCtButton.click()
    parameters.segmentID = nodes["segmentID"]
    host.process()
    T_world_overlay = to_parent(case.node("overlay_frame"))
    np.testing.assert_allclose(T_world_overlay @ T_overlay_ct(case), np.eye(4), atol=1e-6)


def test_nothing_hangs_before_the_organ_in_the_endoscope_view(host, module, nodes):
    module.ui.endoscopeViewButton.click()
    view = slicer.app.layoutManager().threeDWidget(0).mrmlViewNode()
    assert not view.GetBoxVisible() and not view.GetAxisLabelsVisible()
