"""The transforms of a case against the core's own mapping: on points, nodes and files, before and after saving."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
import vtk
from outcome_example import grids, organ, outcome, segmentation_node, splat_node, true_world_points, world_points
from scipy.spatial import cKDTree
from vtk.util.numpy_support import vtk_to_numpy

from organphys.exports.grid_axes import GridAxes, cubic
from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from OrganPhysRegistrationLib.inputs.splat_scale import set_scale
from OrganPhysRegistrationLib.outputs import inverse_transform
from OrganPhysRegistrationLib.outputs.apply_transform import apply_to, harden, take_out
from OrganPhysRegistrationLib.outputs.case_exports import export_transform
from OrganPhysRegistrationLib.outputs.case_nodes import CaseNodes, write_grids, write_outcome
from OrganPhysRegistrationLib.outputs.follow_splat import follow_splat, results_follow
from OrganPhysRegistrationLib.outputs.geometry import point_cloud, points_of
from OrganPhysRegistrationLib.outputs.grid_transforms import grid_in
from OrganPhysRegistrationLib.outputs.overlay_frame import set_overlay
from OrganPhysRegistrationLib.outputs.volume_node import asset_of

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
    node = case.node("scene_to_ct")
    back = world_points(node, true_world_points(case, inside))
    assert np.linalg.norm(back - inside, axis=1).max() < EXACT_MM
    assert node.GetAttribute("OrganPhys.Inverse") == "solved"
    assert float(node.GetAttribute("OrganPhys.RoundTripMaxMm")) < 0.02


def test_sampled_inverse_is_taken_where_solving_fails(inputs, inside, monkeypatch):
    def pretended(inverse, *_):
        return 10.0 * bool(inverse.GetConcatenatedTransform(1).GetInverseFlag())

    monkeypatch.setattr(inverse_transform, "round_trip_mm", pretended)
    case = write_outcome(outcome(), **inputs)
    assert case.node("scene_to_ct").GetAttribute("OrganPhys.Inverse") == "sampled"
    set_scale(case.splat, 40.0, "stated")
    follow_splat(case)
    back = world_points(case.node("scene_to_ct"), true_world_points(case, inside))
    assert np.linalg.norm(back - inside, axis=1).max() < EXACT_MM


@pytest.mark.parametrize("reload", [False, True])
def test_results_follow_the_splat_to_another_scale(case, inside, host, tmp_path, reload):
    if reload:
        slicer.util.saveScene(str(tmp_path / "case.mrb"))
        host.clear_scene()
        slicer.util.loadScene(str(tmp_path / "case.mrb"))
        case = CaseNodes.find()
    assert not follow_splat(case)
    set_overlay(case, "CT")
    set_scale(case.splat, 40.0, "stated")
    assert results_follow(case.splat) == 1
    set_overlay(case, "endoscope")
    true = true_world_points(case, inside)
    assert np.abs(points_of(case.node("volume").GetPolyData())[::7] - true).max() < 1e-3
    assert np.linalg.norm(world_points(case.node("ct_to_scene"), inside) - true, axis=1).max() < EXACT_MM
    assert np.linalg.norm(world_points(case.node("scene_to_ct"), true) - inside, axis=1).max() < EXACT_MM
    assert asset_of(case).name == "ellipsoid"
    similarity = np.array(case.record["T_overlay_scene"])
    assert np.cbrt(np.linalg.det(similarity[:3, :3])) == pytest.approx(40)


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
    assert float(node.GetAttribute("OrganPhys.LinearErrorMaxMm")) == 0.07
    assert float(node.GetAttribute("OrganPhys.GridSpacingMm")) == 3
    assert 0 < float(node.GetAttribute("OrganPhys.GridMB")) < 10
    assert node.GetAttribute("OrganPhys.Transform") == "elastic"


def test_the_core_measures_with_the_interpolation_of_slicer(case, inside):
    grid = outcome().grids.forward
    axes = GridAxes(np.asarray(grid.origin), float(grid.spacing[0]), grid.vectors.shape[2::-1])
    moved = inside + cubic(grid.vectors, axes, inside)
    alone = grid_in(case.node("ct_to_scene"))
    assert max(np.linalg.norm(np.array(alone.TransformPoint(p)) - q) for p, q in zip(inside, moved, strict=True)) < 1e-4


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


@pytest.mark.parametrize("turn", [np.eye(3), rotation_about(np.array([1.0, 2, 3]), 0.8)], ids=["straight", "oblique"])
def test_hardened_segments_follow_the_organ_whole(case, scene, turn):
    centre = organ().vertices.mean(0) + np.array([15.0, 0, 5])
    tumour = segmentation_node(scene, "tumour", lambda p: np.linalg.norm(p - centre, axis=1) < 18, turn=turn, step=3)
    before = _voxels(tumour)
    apply_to(case, tumour)
    harden(case, tumour)
    assert tumour.GetParentTransformNode() is None
    after, true = _voxels(tumour), true_world_points(case, before)
    assert np.linalg.norm(after.mean(0) - _true_centroid(case, before)) < 0.2  # voxels of 3 mm
    assert len(after) == pytest.approx(len(before), rel=0.05)
    assert cKDTree(after).query(true)[0].max() < 3
    with pytest.raises(InputError, match="apply"):
        harden(case, tumour)


def test_segments_that_share_a_label_map_keep_their_labels(case, scene):
    half = organ().vertices.mean(0)[0]
    node = segmentation_node(scene, "halves", lambda p: (p[:, 0] < half) & (organ().outside_distance_mm(p) == 0))
    other = segmentation_node(scene, "other", lambda p: (p[:, 0] >= half) & (organ().outside_distance_mm(p) == 0))
    node.GetSegmentation().CopySegmentFromSegmentation(
        other.GetSegmentation(), other.GetSegmentation().GetNthSegmentID(0)
    )
    node.GetSegmentation().CollapseBinaryLabelmaps(True)
    before = [_voxels(node, k) for k in (0, 1)]
    apply_to(case, node)
    harden(case, node)
    for k in (0, 1):
        assert np.linalg.norm(_voxels(node, k).mean(0) - _true_centroid(case, before[k])) < 0.2  # voxels of 4 mm


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


def _voxels(segmentation, k: int = 0) -> np.ndarray:
    """Centres (N, 3) of a segment's voxels, mm."""
    image, matrix = slicer.vtkOrientedImageData(), vtk.vtkMatrix4x4()
    segmentation.GetBinaryLabelmapRepresentation(segmentation.GetSegmentation().GetNthSegmentID(k), image)
    labels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[::-1])
    image.GetImageToWorldMatrix(matrix)
    indices = np.argwhere(labels > 0)[:, ::-1] + np.array(image.GetExtent())[::2]
    m = slicer.util.arrayFromVTKMatrix(matrix)
    return indices @ m[:3, :3].T + m[:3, 3]


def _true_centroid(case, voxels) -> np.ndarray:
    """Centroid of the deformed voxels, whose volumes differ."""
    volumes = np.linalg.det(organ().deformation_gradient(voxels))
    return np.average(true_world_points(case, voxels), axis=0, weights=volumes)


def _translation(x, y, z):
    matrix = vtk.vtkMatrix4x4()
    for row, value in enumerate((x, y, z)):
        matrix.SetElement(row, 3, value)
    return matrix
