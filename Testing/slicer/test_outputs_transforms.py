"""The transforms of a case against the core's own mapping: on points, nodes and files, before and after saving."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
import vtk
from outcome_example import grids, organ, outcome, segmentation_node, splat_node, true_world_points, world_points
from vtk.util.numpy_support import vtk_to_numpy

from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.outputs.apply_transform import apply_to, take_out
from OrganPhysRegistrationLib.outputs.case_exports import export_transform
from OrganPhysRegistrationLib.outputs.case_nodes import write_grids, write_outcome
from OrganPhysRegistrationLib.outputs.geometry import point_cloud, points_of

EXACT_MM = 0.1


@pytest.fixture
def inputs(scene):
    segmentation = segmentation_node(scene)
    segment_id = segmentation.GetSegmentation().GetNthSegmentID(0)
    return {"segmentation": segmentation, "segment_id": segment_id, "splat": splat_node(scene)}


@pytest.fixture
def case(inputs):
    return write_outcome(outcome(), **inputs)


@pytest.fixture
def inside():
    return organ().volume_points[::7]


def test_ct_to_scene_is_the_organs_mapping(case, inside):
    error = np.linalg.norm(world_points(case.node("ct_to_scene"), inside) - true_world_points(case, inside), axis=1)
    assert error.max() < EXACT_MM
    similarity_only = write_outcome(outcome(sampled=False), **_inputs_of(case)).node("ct_to_scene")
    assert np.linalg.norm(world_points(similarity_only, inside) - true_world_points(case, inside), axis=1).max() > 3
    assert "not sampled" in similarity_only.GetAttribute("OrganPhys.Transform")
    write_grids(case, grids())
    assert np.linalg.norm(world_points(similarity_only, inside) - true_world_points(case, inside), axis=1).max() < 0.1
    assert similarity_only.GetAttribute("OrganPhys.Transform") == "elastic"


def test_scene_to_ct_is_its_inverse(case, inside):
    back = world_points(case.node("scene_to_ct"), true_world_points(case, inside))
    assert np.linalg.norm(back - inside, axis=1).max() < EXACT_MM


def test_far_from_the_organ_the_similarity_holds(case):
    far = organ().vertices.mean(0) + np.array([[300.0, 0, 0], [0, -500, 40]])
    error = np.linalg.norm(world_points(case.node("ct_to_scene"), far) - true_world_points(case, far), axis=1)
    assert error.max() < EXACT_MM


def test_splat_stands_in_ct_millimetres_under_its_transform(case, inside):
    scene_points = organ().T_scene_ct.apply(inside)
    assert np.abs(world_points(case.node("splat_to_ct_mm"), scene_points) - inside).max() < 1e-6


def test_accuracy_and_size_of_the_grid_are_told(case):
    node = case.node("ct_to_scene")
    assert float(node.GetAttribute("OrganPhys.SamplingErrorMaxMm")) == 0.04
    assert float(node.GetAttribute("OrganPhys.GridSpacingMm")) == 3
    assert 0 < float(node.GetAttribute("OrganPhys.GridMB")) < 10
    assert node.GetAttribute("OrganPhys.Transform") == "elastic"


@pytest.mark.parametrize("inverse", [False, True])
def test_h5_file_gives_the_same_mapping(case, inside, tmp_path, inverse):
    path = tmp_path / "transform.h5"
    export_transform(case, path, inverse=inverse)
    loaded = slicer.util.loadTransform(str(path))
    source, target = inside, true_world_points(case, inside)
    if inverse:
        source, target = target, source
    assert np.linalg.norm(world_points(loaded, source) - target, axis=1).max() < EXACT_MM
    saved = case.node("scene_to_ct" if inverse else "ct_to_scene")
    assert np.abs(world_points(loaded, source) - world_points(saved, source)).max() < 1e-6


def test_nrrd_file_holds_the_whole_displacement(case, inside, tmp_path):
    path = tmp_path / "transform.nrrd"
    export_transform(case, path)
    loaded = slicer.modules.transforms.logic().AddTransform(str(path), slicer.mrmlScene)
    error = np.linalg.norm(world_points(loaded, inside) - true_world_points(case, inside), axis=1)
    assert error.max() < EXACT_MM
    with pytest.raises(InputError, match=r"\.h5"):
        export_transform(case, path, inverse=True)


def test_overlay_does_not_change_what_is_exported(case, inside, tmp_path):
    from OrganPhysRegistrationLib.outputs.overlay_frame import set_overlay

    true = true_world_points(case, inside)
    set_overlay(case, "CT")
    export_transform(case, tmp_path / "transform.h5")
    loaded = slicer.util.loadTransform(str(tmp_path / "transform.h5"))
    assert np.linalg.norm(world_points(loaded, inside) - true, axis=1).max() < EXACT_MM


def test_hardened_model_follows_the_organ(case, inside, scene):
    model = scene.AddNewNodeByClass("vtkMRMLModelNode", "vessels")
    model.SetAndObserveMesh(point_cloud(inside))
    apply_to(case, model)
    model.HardenTransform()
    assert np.linalg.norm(points_of(model.GetPolyData()) - true_world_points(case, inside), axis=1).max() < EXACT_MM


def test_hardened_markups_follow_the_organ(case, inside, scene):
    points = scene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "landmarks")
    slicer.util.updateMarkupsControlPointsFromArray(points, inside[:5])
    apply_to(case, points)
    points.HardenTransform()
    at = slicer.util.arrayFromMarkupsControlPoints(points)
    assert np.abs(at - true_world_points(case, inside[:5])).max() < EXACT_MM


def test_hardened_tumour_segment_follows_the_organ(case, scene):
    centre = organ().vertices.mean(0) + np.array([15.0, 0, 5])
    tumour = segmentation_node(scene, "tumour", lambda at: np.linalg.norm(at - centre, axis=1) < 14)
    image = tumour.GetSegmentation().GetNthSegment(0).GetRepresentation("Binary labelmap")
    true = true_world_points(case, _voxels(image)).mean(0)
    apply_to(case, tumour)
    tumour.HardenTransform()
    moved = tumour.GetSegmentation().GetNthSegment(0).GetRepresentation("Binary labelmap")
    assert np.linalg.norm(_voxels(moved).mean(0) - true) < 0.4  # voxels of 4 mm


def test_node_under_another_transform_is_refused_or_keeps_it(case, inside, scene):
    shift = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode", "CT shift")
    shift.SetMatrixTransformToParent(_translation(10, 0, 0))
    models = [scene.AddNewNodeByClass("vtkMRMLModelNode", name) for name in ("vessels", "stays")]
    for model in models:
        model.SetAndObserveMesh(point_cloud(inside - np.array([10, 0, 0])))
        model.SetAndObserveTransformNodeID(shift.GetID())
    with pytest.raises(InputError, match="CT shift"):
        apply_to(case, models[0])
    nodes = scene.GetNumberOfNodes()
    apply_to(case, models[0], keep_parent=True)
    apply_to(case, models[0])  # already there: nothing changes
    at = world_points(models[0].GetParentTransformNode(), inside - np.array([10, 0, 0]))
    assert np.linalg.norm(at - true_world_points(case, inside), axis=1).max() < EXACT_MM
    assert models[1].GetParentTransformNode() is shift
    take_out(case, models[0])
    assert models[0].GetParentTransformNode() is shift
    assert scene.GetNumberOfNodes() == nodes


def test_results_and_the_splat_are_refused(case, inputs):
    for node in (inputs["splat"], case.node("surface_elastic"), case.node("metrics"), None):
        with pytest.raises(InputError):
            apply_to(case, node)


def _inputs_of(case):
    return {"segmentation": case.segmentation, "segment_id": case.segment_id, "splat": case.splat}


def _voxels(image) -> np.ndarray:
    """Centres (N, 3) of the labelled voxels of an oriented image, mm."""
    i, j, k = image.GetDimensions()
    labelled = np.argwhere(vtk_to_numpy(image.GetPointData().GetScalars()).reshape(k, j, i) > 0)[:, ::-1]
    extent, matrix = np.array(image.GetExtent())[::2], vtk.vtkMatrix4x4()
    image.GetImageToWorldMatrix(matrix)
    m = slicer.util.arrayFromVTKMatrix(matrix)
    return (labelled + extent) @ m[:3, :3].T + m[:3, 3]


def _translation(x, y, z):
    matrix = vtk.vtkMatrix4x4()
    for row, value in enumerate((x, y, z)):
        matrix.SetElement(row, 3, value)
    return matrix
