"""The panel after a run: stages, figures, overlay, pose by hand, other nodes, exports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import qt
import slicer
from outcome_example import organ, outcome, segmentation_node, splat_node

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.choices import OverlayIn, Stage, SurfaceColour
from OrganPhysRegistrationLib.inputs.matrices import array_of
from OrganPhysRegistrationLib.logic import OrganPhysRegistrationLogic
from OrganPhysRegistrationLib.outputs.case_nodes import write_outcome
from OrganPhysRegistrationLib.outputs.overlay_frame import overlay_in
from OrganPhysRegistrationLib.outputs.snapshot import remove_case
from OrganPhysRegistrationLib.outputs.stage_switch import shown_stage
from OrganPhysRegistrationLib.outputs.surface_colours import colour_surfaces, legend_of

METRICS = {
    "rigid": {"trim30_splat_to_ct": {"value": 2.345, "unit": "mm"}},
    "elastic": {
        "trim30_splat_to_ct": {"value": 0.812, "unit": "mm"},
        "volume_drift": {"value": -0.4, "unit": "%"},
        "min_det_F": {"value": 0.71, "unit": "1"},
    },
}


@pytest.fixture(autouse=True)
def no_child_process(monkeypatch):
    """The registration process is not started ahead of a run: nothing runs here."""
    monkeypatch.setattr(OrganPhysRegistrationLogic, "warmUp", lambda self: None)


@pytest.fixture
def panel_of(module):
    return module.widget.panel


@pytest.fixture
def case(host, scene, module, panel_of):
    """A finished case in the panel."""
    segmentation = segmentation_node(scene)
    nodes = {
        "segmentation": segmentation,
        "segmentID": segmentation.GetSegmentation().GetNthSegmentID(0),
        "splat": splat_node(scene),
    }
    panel_of.choose(nodes)
    made = write_outcome(
        outcome(metrics=METRICS), segmentation=segmentation, segment_id=nodes["segmentID"], splat=nodes["splat"]
    )
    panel_of.choose({"caseID": made.case_id, "shownStage": Stage.Elastic})
    host.process()
    return made


def test_figures_are_shown_with_their_units(module, case, screenshot):
    ui = module.ui
    assert not ui.resultButton.collapsed
    assert ui.scaleValueLabel.text == f"{1 / organ().T_scene_ct.scale:.4g} mm per scene unit"
    assert ui.secondsValueLabel.text.endswith(" s")
    assert ui.distanceValueLabel.text == "0.81 mm"
    assert ui.volumeValueLabel.text == "-0.40 %"
    assert ui.detFValueLabel.text == "0.71"
    screenshot(module.panel, "panel_result")


def test_stages_can_be_switched(host, module, panel_of, case):
    module.ui.stageRigidButton.click()
    host.process()
    assert shown_stage(case) == "rigid"
    assert panel_of.parameters.shownStage is Stage.Rigid
    assert case.node("surface_rigid").GetDisplayVisibility()
    assert not case.node("surface_elastic").GetDisplayVisibility()
    assert module.ui.stageRigidButton.checked
    assert module.ui.distanceValueLabel.text == "2.35 mm"
    assert module.ui.volumeValueLabel.text == "–"  # the rigid stage deforms nothing


def test_stages_that_were_not_run_cannot_be_chosen(host, module, panel_of, case):
    rigid = outcome("rigid")
    write_outcome(rigid, segmentation=case.segmentation, segment_id=case.segment_id, splat=case.splat)
    panel_of.choose({"shownStage": Stage.Rigid})
    host.process()
    assert not module.ui.stageElasticButton.enabled
    assert module.ui.stageCoarseButton.enabled


def test_overlay_moves_to_the_ct_and_back(host, module, panel_of, case):
    assert module.ui.overlayEndoscopeButton.checked
    assert module.ui.stageElasticButton.checked
    module.ui.overlayCtButton.click()
    assert module.ui.overlayCtButton.checked
    assert overlay_in(case) == "CT"
    assert panel_of.parameters.overlayIn is OverlayIn.CT
    assert not np.allclose(array_of(case.node("overlay_frame").GetMatrixTransformToParent()), np.eye(4))
    module.ui.overlayEndoscopeButton.click()
    assert np.allclose(array_of(case.node("overlay_frame").GetMatrixTransformToParent()), np.eye(4))


def test_a_pose_set_by_hand_starts_the_next_stages(host, module, case, monkeypatch):
    asked = []
    monkeypatch.setattr(module.logic, "startRun", lambda *arguments, **options: asked.append((arguments, options)))
    module.ui.stageRigidButton.click()
    module.ui.adjustPoseButton.click()
    host.process()
    handles = case.node("surface_rigid").GetParentTransformNode()
    matrix = array_of(handles.GetMatrixTransformToParent())
    matrix[0, 3] += 10  # mm
    handles.SetMatrixTransformToParent(slicer.util.vtkMatrixFromArray(matrix))
    assert module.ui.continuePoseButton.enabled
    module.ui.continuePoseButton.click()
    host.process()
    (_, stages), options = asked[0]
    before = np.array(case.record["similarities"]["rigid"])
    T_overlay_scene = np.array(case.record["T_overlay_scene"])
    moved = T_overlay_scene @ options["start"] - T_overlay_scene @ before
    assert stages == ("elastic",)
    assert moved[:3, 3] == pytest.approx([10, 0, 0], abs=1e-6)
    assert not module.ui.adjustPoseButton.checked
    assert case.node("surface_rigid").GetParentTransformNode() is not handles


def test_another_stage_ends_the_adjustment_by_hand(host, module, case):
    module.ui.adjustPoseButton.click()
    host.process()
    assert module.ui.continuePoseButton.enabled
    module.ui.stageCoarseButton.click()
    host.process()
    assert not module.ui.adjustPoseButton.checked
    assert not module.ui.continuePoseButton.enabled
    assert case.node("surface_elastic").GetParentTransformNode() is case.node("overlay_frame")


def test_another_node_moves_with_the_organ(host, module, case):
    tumour = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "tumour")
    tumour.SetAndObserveMesh(case.node("surface_elastic").GetPolyData())
    module.ui.transformedNodeSelector.setCurrentNode(tumour)
    host.process()
    module.ui.applyTransformButton.click()
    assert tumour.GetParentTransformNode() is case.node("ct_to_scene")
    assert "tumour" in module.ui.messageLabel.text
    assert module.ui.applyTransformButton.text == "Take out"
    module.ui.applyTransformButton.click()
    assert tumour.GetParentTransformNode() is None
    assert module.ui.applyTransformButton.text == "Apply"


def test_a_node_that_was_moved_along_can_be_hardened(host, module, case):
    tumour = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", "tumour")
    tumour.SetAndObserveMesh(case.node("surface_elastic").GetPolyData())
    before = slicer.util.arrayFromModelPoints(tumour).copy()
    module.ui.transformedNodeSelector.setCurrentNode(tumour)
    host.process()
    assert not module.ui.hardenButton.enabled
    module.ui.applyTransformButton.click()
    module.ui.hardenButton.click()
    assert tumour.GetParentTransformNode() is None
    assert np.abs(slicer.util.arrayFromModelPoints(tumour) - before).max() > 1  # mm
    assert not module.ui.hardenButton.enabled


def test_a_result_cannot_be_moved_along(host, module, case):
    module.ui.transformedNodeSelector.setCurrentNode(case.node("surface_elastic"))
    host.process()
    module.ui.applyTransformButton.click()
    assert "result of the registration itself" in module.ui.messageLabel.text
    assert host.record.dialogs == []


@pytest.mark.parametrize(
    ("button", "name"),
    [
        ("exportSurfaceButton", "surface.stl"),
        ("exportTransformButton", "transform.h5"),
        ("exportAssetButton", "organ.organphys"),
    ],
)
def test_exports_write_the_file_that_was_asked_for(host, module, case, tmp_path, monkeypatch, button, name):
    monkeypatch.setattr(qt.QFileDialog, "getSaveFileName", staticmethod(lambda *arguments: str(tmp_path / name)))
    getattr(module.ui, button).click()
    assert (tmp_path / name).stat().st_size > 0
    assert str(tmp_path / name) in module.ui.messageLabel.text


def test_an_unknown_kind_of_file_is_told(host, module, case, tmp_path, monkeypatch):
    monkeypatch.setattr(qt.QFileDialog, "getSaveFileName", staticmethod(lambda *a: str(tmp_path / "surface.xyz")))
    module.ui.exportSurfaceButton.click()
    assert ".stl" in module.ui.messageLabel.text
    assert host.record.dialogs == []


def test_metrics_and_plots_are_shown_in_the_views(host, module, case):
    module.ui.metricsTableButton.click()
    selection = slicer.app.applicationLogic().GetSelectionNode()
    assert selection.GetActiveTableID() == case.node("metrics").GetID()
    menu = module.ui.plotsButton.menu()
    menu.aboutToShow.emit()
    assert [action.text for action in menu.actions()] == ["Convergence", "Volume drift", "Pose search"]
    menu.actions()[0].trigger()
    assert selection.GetActivePlotChartID() == case.node("convergence_chart").GetID()


def test_a_case_whose_nodes_were_deleted_is_told(host, module, case):
    slicer.mrmlScene.RemoveNode(case.node("metrics"))
    module.ui.metricsTableButton.click()
    assert "run the registration" in module.ui.messageLabel.text


def test_choosing_another_organ_shows_its_results(host, module, panel_of, case):
    first = case.segment_id
    other = case.segmentation.GetSegmentation().AddEmptySegment("", "not registered yet")
    panel_of.choose({"segmentID": other})
    host.process()
    assert panel_of.case() is None
    assert module.ui.distanceValueLabel.text == "–"
    panel_of.choose({"segmentID": first})
    host.process()
    assert panel_of.case().case_id == case.case_id


def test_a_deleted_case_disappears_from_the_panel(host, module, panel_of, case):
    remove_case(case)
    host.process()
    assert panel_of.case() is None
    assert not module.ui.stageElasticButton.enabled


def test_result_comes_back_with_the_scene(host, module, panel_of, case, tmp_path):
    assert slicer.util.saveScene(str(tmp_path / "scene.mrb"))
    slicer.mrmlScene.Clear(0)
    host.process()
    assert module.ui.distanceValueLabel.text == "–"
    slicer.util.loadScene(str(tmp_path / "scene.mrb"))
    host.process()
    assert panel_of.case().case_id == case.case_id
    assert module.ui.stageElasticButton.enabled
    assert module.ui.distanceValueLabel.text == "0.81 mm"


VERDICT = {
    "level": "check",
    "headline": "Check: look at the overlay.",
    "reasons": [{"code": "little_seen", "level": "check", "message": "Only 9 % <is> seen."}],
}


@pytest.fixture
def sure_case(host, case, panel_of):
    """The same case with error radii and a verdict."""
    count = len(organ().vertices)
    errors = {"error_68_mm": np.linspace(0.5, 3, count), "error_95_mm": np.linspace(1, 6, count)}
    metrics = METRICS | {"elastic": METRICS["elastic"] | {"error_95_hidden": {"value": 4.56, "unit": "mm"}}}
    sure = outcome(metrics=metrics, verdict=VERDICT, **errors)
    write_outcome(sure, segmentation=case.segmentation, segment_id=case.segment_id, splat=case.splat)
    panel_of.refresh()
    host.process()
    return case


def test_verdict_and_error_radius_are_told(module, sure_case, screenshot):
    ui = module.ui
    assert ui.verdictLabel.visible
    assert "Check: look at the overlay." in ui.verdictLabel.text
    assert "Only 9 % &lt;is&gt; seen." in ui.verdictLabel.text
    assert ui.errorValueLabel.text == "4.56 mm"
    screenshot(module.panel, "panel_verdict")


def test_a_case_without_a_verdict_shows_none(module, case):
    assert not module.ui.verdictLabel.visible
    assert module.ui.errorValueLabel.text == "–"


def test_surface_is_coloured_by_the_error_radius_with_its_legend(host, module, panel_of, sure_case):
    display = sure_case.node("surface_elastic").GetDisplayNode()
    assert display.GetActiveScalarName() == "distance_mm"
    distance_range = display.GetScalarRange()
    panel_of.choose({"surfaceColour": SurfaceColour.Error95})
    host.process()
    legend = legend_of(sure_case.node("surface_elastic"))
    assert display.GetActiveScalarName() == "error_95_mm"
    assert display.GetScalarRange() == (0.0, 6.0)
    assert legend.GetTitleText() == "95 % error radius (mm)"
    panel_of.choose({"surfaceColour": SurfaceColour.Distance})
    host.process()
    assert display.GetActiveScalarName() == "distance_mm"
    assert display.GetScalarRange() == distance_range
    assert legend.GetTitleText().startswith("Distance to the splat (mm)")


def test_chosen_colours_last_over_the_next_run(host, panel_of, sure_case):
    panel_of.choose({"surfaceColour": SurfaceColour.Error68})
    host.process()
    again = outcome(error_68_mm=np.full(len(organ().vertices), 7.0))
    write_outcome(again, segmentation=sure_case.segmentation, segment_id=sure_case.segment_id, splat=sure_case.splat)
    display = sure_case.node("surface_elastic").GetDisplayNode()
    assert display.GetActiveScalarName() == "error_68_mm"
    assert display.GetScalarRange() == (0.0, 8.0)


def test_colours_that_a_case_lacks_leave_the_distance(host, module, panel_of, case):
    panel_of.choose({"surfaceColour": SurfaceColour.Error95})
    host.process()
    assert case.node("surface_elastic").GetDisplayNode().GetActiveScalarName() == "distance_mm"
    with pytest.raises(InputError, match="register it again"):
        colour_surfaces(case, "error_95_mm")
    with pytest.raises(InputError):
        colour_surfaces(case, "temperature")


def test_verdict_is_in_the_metrics_table_and_the_report(module, sure_case, tmp_path):
    table = sure_case.node("metrics").GetTable()
    rows = [[table.GetValue(k, c).ToString() for c in range(4)] for k in range(table.GetNumberOfRows())]
    assert ["verdict", "check", "Check: look at the overlay.", ""] in rows
    assert ["verdict", "little seen", "Only 9 % <is> seen.", ""] in rows
    path = module.logic.export(sure_case, "report", tmp_path / "report.html")
    html = Path(path).read_text(encoding="utf-8")
    assert "Check: look at the overlay." in html and html.count("Only 9 % &lt;is&gt; seen.") == 1
