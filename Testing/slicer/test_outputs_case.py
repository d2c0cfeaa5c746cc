"""Nodes of a case: what they hold, that a rerun refills them, that a failure or an undo leaves nothing behind."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from outcome_example import organ, outcome, segmentation_node, splat_node
from vtk.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.inputs.splat_scale import mm_per_unit_of
from OrganPhysRegistrationLib.outputs import case_nodes
from OrganPhysRegistrationLib.outputs.case_nodes import CaseNodes, write_outcome
from OrganPhysRegistrationLib.outputs.geometry import points_of
from OrganPhysRegistrationLib.outputs.overlay_frame import overlay_in, set_overlay
from OrganPhysRegistrationLib.outputs.snapshot import remove_case
from OrganPhysRegistrationLib.outputs.stage_switch import show_stage, shown_stage
from OrganPhysRegistrationLib.outputs.surface_nodes import legend_of
from OrganPhysRegistrationLib.outputs.undo import begin_run
from OrganPhysRegistrationLib.outputs.volume_node import asset_of


@pytest.fixture
def inputs(scene):
    segmentation = segmentation_node(scene)
    return {
        "segmentation": segmentation,
        "segment_id": segmentation.GetSegmentation().GetNthSegmentID(0),
        "splat": splat_node(scene),
    }


@pytest.fixture
def case(inputs):
    return write_outcome(outcome(), **inputs)


def nodes_in(contents) -> set[str]:
    return {line for line in contents if not line.startswith("item")} | {
        line.split(maxsplit=2)[2] for line in contents if line.startswith("item")
    }


def test_surfaces_stand_where_the_organ_is_in_the_world(case, inputs):
    matrix = np.array(case.record["T_overlay_scene"])
    assert np.cbrt(np.linalg.det(matrix[:3, :3])) == pytest.approx(1 / organ().T_scene_ct.scale)
    for stage in ("before", "coarse", "rigid", "elastic"):
        expected = outcome().surfaces[stage] @ matrix[:3, :3].T + matrix[:3, 3]
        assert np.abs(points_of(case.node(f"surface_{stage}").GetPolyData()) - expected).max() < 1e-4
    assert mm_per_unit_of(inputs["splat"])[1] == "registered"


def test_surface_carries_arrays_colours_and_a_legend_in_mm(case):
    surface = case.node("surface_elastic")
    arrays = surface.GetPolyData().GetPointData()
    assert np.allclose(vtk_to_numpy(arrays.GetArray("det_F")), organ().surface_det_f)
    assert arrays.GetArray("displacement_mm").GetRange()[1] > 5
    display = surface.GetDisplayNode()
    assert display.GetActiveScalarName() == "distance_mm"
    assert display.GetScalarRange() == (0.0, 4.0)
    assert case.node("surface_coarse").GetDisplayNode().GetScalarRange() == (0.0, 4.0)  # its distances reach 15 mm
    assert "(mm)" in legend_of(surface).GetTitleText()
    assert display.GetColorNode().GetNumberOfColors() == 256


def test_second_run_refills_the_same_nodes(case, inputs, scene_contents):
    before = scene_contents()
    again = write_outcome(outcome(shift_mm=30), **inputs)
    assert again == case
    assert scene_contents() == before
    matrix = np.array(case.record["T_overlay_scene"])
    expected = outcome(shift_mm=30).surfaces["coarse"] @ matrix[:3, :3].T + matrix[:3, 3]
    assert np.abs(points_of(case.node("surface_coarse").GetPolyData()) - expected).max() < 1e-4


def test_all_visible_results_are_in_one_folder(case, scene):
    tree = slicer.vtkMRMLSubjectHierarchyNode.GetSubjectHierarchyNode(scene)
    folder = tree.GetItemByUID("OrganPhys.Case", case.case_id)
    inside: list[int] = []
    tree.GetItemChildren(folder, inside, True)
    held = {tree.GetItemDataNode(item) for item in inside}
    for node in case.nodes():
        assert node.GetHideFromEditors() or node in held, node.GetName()


def test_shorter_run_removes_what_is_out_of_date(case, inputs):
    write_outcome(outcome("coarse"), **inputs)
    assert case.stages == ["before", "coarse"]
    assert case.get("volume") is None
    assert case.get("convergence_chart") is None
    assert case.get("twist_chart") is not None
    assert case.node("ct_to_scene").IsLinear()


def test_metrics_table_has_units_and_warnings_in_words(case):
    table = case.node("metrics").GetTable()
    names = [table.GetColumnName(k) for k in range(table.GetNumberOfColumns())]
    rows = [tuple(table.GetValue(i, k).ToString() for k in range(4)) for i in range(table.GetNumberOfRows())]
    assert names == ["stage", "metric", "value", "unit"]
    assert ("elastic", "mean CT to splat", "1.235", "mm") in rows
    assert ("elastic", "min det F", "0.9", "no unit") in rows
    assert ("warning", "twist ambiguous", "Another pose fits almost as well.", "") in rows
    assert any("sampling error inside" in metric and unit == "mm" for _, metric, _, unit in rows)


def test_plots_have_titles_and_axes_with_units(case):
    chart = case.node("convergence_chart")
    assert chart.GetYAxisTitle() == "distance (mm)"
    assert chart.GetNumberOfPlotSeriesNodes() == 2
    series = chart.GetNthPlotSeriesNode(0)
    values = vtk_to_numpy(series.GetTableNode().GetTable().GetColumnByName(series.GetYColumnName()))
    assert np.allclose(values, [3.0, 2.6, 2.2, 1.8, 1.4])
    assert "%" in case.node("volume_chart").GetYAxisTitle()
    assert "deg" in case.node("twist_chart").GetXAxisTitle()


def test_stage_switch_shows_one_surface_and_its_legend(case):
    show_stage(case, "coarse")
    shown = [s for s in case.stages if case.node(f"surface_{s}").GetDisplayVisibility()]
    legends = [s for s in case.stages if legend_of(case.node(f"surface_{s}")).GetVisibility()]
    assert shown == legends == ["coarse"] == [shown_stage(case)]
    with pytest.raises(InputError, match="stage"):
        show_stage(case, "plastic")


def test_overlay_in_ct_brings_the_organ_onto_the_ct(case):
    set_overlay(case, "CT")
    surface = case.node("surface_elastic")
    frame = np.array(slicer.util.arrayFromTransformMatrix(case.node("overlay_frame")))
    at = points_of(surface.GetPolyData()) @ frame[:3, :3].T + frame[:3, 3]
    assert np.abs(at - organ().vertices - organ().surface_displacement_mm).max() < 1e-3
    assert overlay_in(case) == "CT"
    set_overlay(case, "endoscope")
    assert np.array_equal(slicer.util.arrayFromTransformMatrix(case.node("overlay_frame")), np.eye(4))


def test_stated_unit_is_kept(inputs):
    from OrganPhysRegistrationLib.inputs.splat_scale import set_scale

    set_scale(inputs["splat"], 90.0, "stated", percent=5)
    write_outcome(outcome(), **inputs)
    assert mm_per_unit_of(inputs["splat"]) == (90.0, "stated", 5.0)


@pytest.mark.parametrize("existing", [False, True])
def test_failure_leaves_the_scene_as_it_was(inputs, scene_contents, monkeypatch, existing):
    if existing:
        write_outcome(outcome("rigid"), **inputs)
    before, scale = scene_contents(), mm_per_unit_of(inputs["splat"])

    def fail(*_):
        raise RuntimeError("table")

    monkeypatch.setattr(case_nodes, "write_charts", fail)
    with pytest.raises(RuntimeError):
        write_outcome(outcome(), **inputs)
    assert scene_contents() == before
    assert mm_per_unit_of(inputs["splat"]) == scale
    if existing:
        assert CaseNodes.find().stage == "rigid"
        assert CaseNodes.find().node("ct_to_scene").IsLinear()


def test_undo_of_the_first_run_removes_everything(inputs, scene_contents):
    before, scale = scene_contents(), mm_per_unit_of(inputs["splat"])
    undo = begin_run(**inputs)
    write_outcome(outcome("coarse"), **inputs, case_id=undo.case_id)
    write_outcome(outcome(), **inputs, case_id=undo.case_id)
    undo.undo()
    assert scene_contents() == before
    assert mm_per_unit_of(inputs["splat"]) == scale
    assert not undo.possible


def test_undo_of_the_second_run_brings_the_first_back(case, inputs, scene_contents):
    show_stage(case, "rigid")
    before, record = scene_contents(), case.record
    points = points_of(case.node("surface_coarse").GetPolyData())
    undo = begin_run(**inputs)
    write_outcome(outcome("coarse", shift_mm=50), **inputs)
    undo.undo()
    assert nodes_in(scene_contents()) == nodes_in(before)
    assert case.record == record
    assert np.array_equal(points_of(case.node("surface_coarse").GetPolyData()), points)
    assert case.node("surface_rigid").GetDisplayVisibility()
    assert asset_of(case).name == "ellipsoid"
    assert not case.node("ct_to_scene").IsLinear()
    assert legend_of(case.node("surface_rigid")).GetVisibility()
    assert case.node("convergence_chart").GetNthPlotSeriesNode(0).GetTableNode() is case.node("convergence_table")
    with pytest.raises(InputError, match="undone"):
        undo.undo()


def test_removing_a_case_leaves_the_splat_alone(inputs, scene_contents):
    before = scene_contents()
    case = write_outcome(outcome(), **inputs)
    remove_case(case)
    assert scene_contents() == before
    assert CaseNodes.find() is None


def test_two_organs_share_one_splat(inputs, scene):
    first = write_outcome(outcome(), **inputs)
    other = segmentation_node(scene, "other")
    second = write_outcome(outcome(), segmentation=other, segment_id=inputs["segment_id"], splat=inputs["splat"])
    assert second.case_id != first.case_id
    assert second.node("overlay_frame") is first.node("overlay_frame")
    remove_case(first)
    set_overlay(second, "CT")
    assert overlay_in(second) == "CT"
    assert inputs["splat"].GetParentTransformNode().GetParentTransformNode() is second.node("overlay_frame")
