"""A case after its scene was saved and loaded: found, shown, exported; and the files that it exports."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from outcome_example import organ, outcome, segmentation_node, splat_node, true_world_points, world_points
from vtk.util.numpy_support import vtk_to_numpy

from organphys import load_asset
from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.outputs.case_exports import export_asset, export_surface, export_transform
from OrganPhysRegistrationLib.outputs.case_nodes import CaseNodes, write_outcome
from OrganPhysRegistrationLib.outputs.geometry import points_of
from OrganPhysRegistrationLib.outputs.overlay_frame import set_overlay
from OrganPhysRegistrationLib.outputs.report_export import export_report
from OrganPhysRegistrationLib.outputs.stage_switch import show_stage
from OrganPhysRegistrationLib.outputs.surface_nodes import legend_of
from OrganPhysRegistrationLib.outputs.volume_node import asset_bytes, asset_of


@pytest.fixture
def inputs(scene):
    segmentation = segmentation_node(scene)
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    return {"segmentation": segmentation, "segment_id": segment_id, "splat": splat_node(scene)}


@pytest.fixture
def case(inputs):
    return write_outcome(outcome(), **inputs)


@pytest.fixture
def loaded(case, inputs, host, tmp_path):
    """The case of an .mrb that was saved, after the scene was cleared."""
    assert slicer.util.saveScene(str(tmp_path / "case.mrb"))
    host.clear_scene()
    assert CaseNodes.find() is None
    slicer.util.loadScene(str(tmp_path / "case.mrb"))
    return CaseNodes.find()


def test_everything_comes_back(loaded):
    inside = organ().volume_points[::11]
    assert loaded.segmentation is not None
    assert loaded.splat is not None
    assert loaded.stages == ["before", "coarse", "rigid", "elastic"]
    true = true_world_points(loaded, inside)
    assert np.linalg.norm(world_points(loaded.node("ct_to_scene"), inside) - true, axis=1).max() < 0.1
    assert np.linalg.norm(world_points(loaded.node("scene_to_ct"), true) - inside, axis=1).max() < 0.1
    assert asset_bytes(loaded) == outcome().asset
    assert np.abs(asset_of(loaded).map_points(inside) - organ().map_points(inside)).max() < 1e-9
    assert loaded.node("convergence_chart").GetNthPlotSeriesNode(0).GetTableNode() is loaded.node("convergence_table")


def test_colours_and_legends_come_back(loaded):
    display = loaded.node("surface_elastic").GetDisplayNode()
    assert display.GetColorNode() is loaded.node("colours")
    assert display.GetScalarRange() == (0.0, 4.0)
    colour = [0.0] * 4
    display.GetColorNode().GetColor(0, colour)
    assert np.allclose(colour[:3], np.array([68, 1, 84]) / 255, atol=0.01)
    assert legend_of(loaded.node("surface_elastic")).GetVisibility()


def test_a_loaded_case_can_be_switched_moved_and_run_again(loaded, scene_contents):
    show_stage(loaded, "coarse")
    set_overlay(loaded, "CT")
    before = scene_contents()
    again = write_outcome(outcome(), segmentation=loaded.segmentation, segment_id=loaded.segment_id, splat=loaded.splat)
    assert again.case_id == loaded.case_id
    assert scene_contents() == before


def test_a_loaded_case_exports(loaded, tmp_path):
    export_asset(loaded, tmp_path / "organ.organphys")
    assert load_asset(tmp_path / "organ.organphys").name == "ellipsoid"
    export_surface(loaded, tmp_path / "surface.stl")
    export_transform(loaded, tmp_path / "transform.nrrd")
    export_report(loaded, tmp_path / "report.html")
    assert "ellipsoid" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize("suffix", ["stl", "ply", "vtp"])
def test_surface_files_are_read_back_in_place(case, tmp_path, suffix):
    path = tmp_path / f"surface.{suffix}"
    set_overlay(case, "CT")  # the file keeps to the endoscope frame
    export_surface(case, path)
    node = slicer.modules.models.logic().AddModel(str(path))
    expected = true_world_points(case, organ().vertices)
    assert _farthest(expected, points_of(node.GetPolyData())) < 0.01
    if suffix == "vtp":
        assert np.allclose(vtk_to_numpy(node.GetPolyData().GetPointData().GetArray("det_F")), organ().surface_det_f)


def test_surface_in_scene_units(case, tmp_path):
    export_surface(case, tmp_path / "surface.vtp", frame="scene", stage="coarse")
    node = slicer.modules.models.logic().AddModel(str(tmp_path / "surface.vtp"))
    assert np.abs(points_of(node.GetPolyData()) - outcome().surfaces["coarse"]).max() < 1e-5


def test_what_cannot_be_exported_is_told(inputs, tmp_path):
    case = write_outcome(outcome("rigid"), **inputs)
    with pytest.raises(InputError, match="elastic"):
        export_asset(case, tmp_path / "organ.organphys")
    with pytest.raises(InputError, match=r"\.h5"):
        export_transform(case, tmp_path / "transform.nrrd")
    with pytest.raises(InputError, match=r"\.stl"):
        export_surface(case, tmp_path / "surface.obj")
    with pytest.raises(InputError, match="elastic"):
        export_report(case, tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []


def _farthest(points, others) -> float:
    from scipy.spatial import cKDTree

    return float(max(cKDTree(others).query(points)[0].max(), cKDTree(points).query(others)[0].max()))
