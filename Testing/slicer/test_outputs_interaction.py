"""The live overlay and the pose set by hand: what they show, and that nothing of them stays."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from outcome_example import organ, outcome, segmentation_node, splat_node

from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, matrix_of, scale_of
from OrganPhysRegistrationLib.outputs.case_nodes import write_outcome
from OrganPhysRegistrationLib.outputs.geometry import points_of
from OrganPhysRegistrationLib.outputs.live_overlay import LiveOverlay
from OrganPhysRegistrationLib.outputs.pose_adjustment import PoseAdjustment
from OrganPhysRegistrationLib.outputs.stage_switch import show_stage


@pytest.fixture
def splat(scene):
    return splat_node(scene)


@pytest.fixture
def case(scene, splat):
    segmentation = segmentation_node(scene)
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    return write_outcome(outcome(), segmentation=segmentation, segment_id=segment_id, splat=splat)


def test_live_overlay_follows_and_leaves_no_trace(scene, splat, scene_contents):
    before, observed = scene_contents(), splat.GetParentTransformNode().HasObserver("ModifiedEvent")
    live = LiveOverlay(splat, organ().faces)
    for scale in (1.0, 1.1):
        live.update(scale * organ().scene_vertices)
    shown = [n for n in slicer.util.getNodesByClass("vtkMRMLModelNode") if n.GetName().endswith("live overlay")]
    assert len(shown) == 1
    assert np.allclose(points_of(shown[0].GetPolyData()), 1.1 * organ().scene_vertices, atol=1e-6)
    assert shown[0].GetParentTransformNode() is splat.GetParentTransformNode()
    assert not shown[0].GetSaveWithScene()
    live.remove()
    live.remove()
    assert scene_contents() == before
    assert splat.GetParentTransformNode().HasObserver("ModifiedEvent") == observed


def test_live_overlay_hides_the_old_result_meanwhile(case, splat):
    live = LiveOverlay(splat, organ().faces, case)
    assert not case.node("surface_elastic").GetDisplayVisibility()
    live.remove()
    assert case.node("surface_elastic").GetDisplayVisibility()
    assert not case.node("surface_coarse").GetDisplayVisibility()


def test_live_overlay_leaves_a_new_result_as_it_is_shown(case, splat):
    show_stage(case, "rigid")
    live = LiveOverlay(splat, organ().faces, case)
    write_outcome(outcome(), segmentation=case.segmentation, segment_id=case.segment_id, splat=splat)
    live.remove()
    assert case.node("surface_elastic").GetDisplayVisibility()
    assert not case.node("surface_rigid").GetDisplayVisibility()


def test_live_overlay_survives_a_closed_scene(splat, host):
    live = LiveOverlay(splat, organ().faces)
    live.update(organ().scene_vertices)
    host.clear_scene()
    live.update(organ().scene_vertices)
    live.remove()


def test_adjusted_pose_is_where_the_surface_was_put(case, scene_contents):
    show_stage(case, "rigid")
    before, frame = scene_contents(), case.node("surface_rigid").GetParentTransformNode()
    adjustment = PoseAdjustment(case)
    node = adjustment.start()
    assert np.allclose(adjustment.T_scene_ct(), outcome().similarities["rigid"])
    moved = np.eye(4)
    moved[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    moved[:3, 3] = [5, -3, 2]
    node.SetMatrixTransformToParent(matrix_of(moved))
    matrix = np.array(case.record["T_overlay_scene"])
    at = apply_matrix(moved, points_of(case.node("surface_rigid").GetPolyData()))
    assert np.abs(apply_matrix(matrix @ adjustment.T_scene_ct(), organ().vertices) - at).max() < 1e-3
    adjustment.stop()
    assert case.node("surface_rigid").GetParentTransformNode() is frame
    assert scene_contents() == before
    assert not adjustment.active


def test_uneven_scaling_is_made_even_about_the_organ(case):
    adjustment = PoseAdjustment(case)
    node = adjustment.start("coarse")
    centre = points_of(case.node("surface_coarse").GetPolyData()).mean(0)
    stretched = np.diag([1.331, 1, 1, 1.0])
    stretched[:3, 3] = centre - stretched[:3, :3] @ centre
    node.SetMatrixTransformToParent(matrix_of(stretched))
    kept = slicer.util.arrayFromTransformMatrix(node)
    assert np.allclose(kept[:3, :3], 1.1 * np.eye(3))
    assert np.allclose(apply_matrix(kept, centre[None])[0], centre)
    assert scale_of(adjustment.T_scene_ct()) == pytest.approx(1.1 * scale_of(outcome().similarities["coarse"]))
    adjustment.stop()


def test_handles_are_shown_for_shift_turn_and_scale(case):
    adjustment = PoseAdjustment(case)
    display = adjustment.start().GetDisplayNode()
    assert display.GetEditorVisibility()
    assert display.GetEditorTranslationEnabled()
    assert display.GetEditorRotationEnabled()
    assert display.GetEditorScalingEnabled()
    adjustment.stop()


def test_stopping_after_the_scene_was_closed_is_quiet(case, host):
    adjustment = PoseAdjustment(case)
    adjustment.start()
    host.clear_scene()
    assert not adjustment.active
    adjustment.stop()
