"""A splat file as a node: fields by value, place in the world, scale, bad files, saving with the scene."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from splat_files import write_gaussians, write_points
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys import InputError, read_splat
from organphys.readers.gaussian_ply import read_gaussians
from OrganPhysRegistrationLib.inputs.matrices import ROLE, apply_matrix, matrix_of
from OrganPhysRegistrationLib.inputs.organ_surface import organ_surface
from OrganPhysRegistrationLib.inputs.splat_display import shown_gaussians
from OrganPhysRegistrationLib.inputs.splat_node import (
    T_shown_scene,
    T_world_scene,
    checked_splat,
    guess_scale,
    is_splat,
    load_splat,
    mm_per_unit_of,
    scene_to_world,
    set_scale,
    splat_arrays,
)

UPRIGHT = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def column(node, name):
    return vtk_to_numpy(node.GetPolyData().GetPointData().GetArray(name))


def test_node_holds_every_gaussian_in_file_order(scene, sample_case):
    node, file = load_splat(sample_case.splat), read_gaussians(sample_case.splat)
    cloud, arrays = read_splat(sample_case.splat), splat_arrays(node)
    np.testing.assert_array_equal(arrays.centres, cloud.centres)
    np.testing.assert_array_equal(arrays.opacities, cloud.opacities)
    np.testing.assert_array_equal(arrays.valid, cloud.valid)
    np.testing.assert_allclose(arrays.colours, cloud.colours, atol=0.5 / 255 + 1e-6)
    np.testing.assert_allclose(column(node, "scale"), np.exp(file.log_scales), rtol=1e-6)
    quaternions = file.quaternions / np.linalg.norm(file.quaternions, axis=1, keepdims=True)
    np.testing.assert_allclose(column(node, "rotation"), quaternions, atol=1e-6)
    kinds = {name: column(node, name).dtype for name in ("colour", "opacity", "scale", "rotation", "valid")}
    assert kinds == {"colour": "u1", "opacity": "f4", "scale": "f4", "rotation": "f4", "valid": "u1"}
    np.testing.assert_array_equal(shown_gaussians(node), cloud.valid & (cloud.opacities > 0.1))


def test_stands_upright_in_mm(scene, sample_case):
    node = load_splat(sample_case.splat, mm_per_unit=25.0, percent=5)
    np.testing.assert_allclose(T_world_scene(node), np.diag([25, 25, 25, 1]) @ UPRIGHT)
    assert mm_per_unit_of(node) == (25.0, "stated", 5.0)
    right, down, forward = np.eye(3)
    turned = T_world_scene(node)[:3, :3] @ np.stack([right, down, forward], axis=1) / 25
    np.testing.assert_allclose(turned.T, [[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # R, inferior, A
    assert node.GetAttribute("OrganPhys.SplatFile") == str(sample_case.splat)
    assert node.GetAttribute("OrganPhys.SceneFrame").startswith("OpenCV camera")


def test_without_a_unit_the_scale_is_a_guess_and_marked_as_one(scene, sample_case):
    node = load_splat(sample_case.splat)
    scale, kind, _ = mm_per_unit_of(node)
    arrays = splat_arrays(node)
    opaque = arrays.centres[arrays.opacities > 0.1].astype(np.float64)
    distance = np.linalg.norm(opaque - np.median(opaque, axis=0), axis=1)
    assert kind == "guess"
    assert 2 * scale * np.quantile(distance, 0.9) == pytest.approx(200)
    assert mm_per_unit_of(load_splat(sample_case.splat, extent_mm=100))[0] == pytest.approx(scale / 2)


def test_guess_follows_the_organ_but_a_known_unit_does_not(scene, sample_case):
    segmentation = slicer.util.loadSegmentation(str(sample_case.labels))
    surface = organ_surface(segmentation, "Segment_5")
    node = load_splat(sample_case.splat)
    assert guess_scale(node, surface)
    scale, kind, _ = mm_per_unit_of(node)
    assert kind == "guess" and scale == pytest.approx(sample_case.mm_per_unit, rel=0.2)
    set_scale(node, 30)
    assert not guess_scale(node, surface) and mm_per_unit_of(node)[0] == 30


def test_scale_keeps_the_camera_and_what_the_user_turned(scene, sample_case):
    node = load_splat(sample_case.splat, mm_per_unit=10)
    by_hand = np.diag([10.0, 10, 10, 1]) @ np.array([[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1.0]])
    by_hand[:3, 3] = [1, 2, 3]
    scene_to_world(node).SetMatrixTransformToParent(matrix_of(by_hand))
    set_scale(node, 40, "registered")
    expected = by_hand.copy()
    expected[:3, :3] *= 4
    np.testing.assert_allclose(T_world_scene(node), expected, atol=1e-12)
    assert mm_per_unit_of(node)[:2] == (40.0, "registered")
    with pytest.raises(InputError, match="above 0"):
        set_scale(node, 0)


def test_overlay_frame_counts_for_what_is_shown_only(scene, sample_case):
    node = load_splat(sample_case.splat, mm_per_unit=10)
    alone = T_world_scene(node)
    frame, user = (scene.AddNewNodeByClass("vtkMRMLLinearTransformNode", name) for name in ("frame", "user"))
    frame.SetAttribute(ROLE, "overlay_frame")
    moved, shifted = np.eye(4), np.eye(4)
    moved[:3, 3], shifted[:3, 3] = [100, 0, 0], [0, 50, 0]
    frame.SetMatrixTransformToParent(matrix_of(moved))
    user.SetMatrixTransformToParent(matrix_of(shifted))
    scene_to_world(node).SetAndObserveTransformNodeID(frame.GetID())
    frame.SetAndObserveTransformNodeID(user.GetID())
    np.testing.assert_allclose(T_world_scene(node), shifted @ alone)
    np.testing.assert_allclose(T_shown_scene(node), shifted @ moved @ alone)
    assert scene_to_world(node).GetParentTransformNode() is frame


def test_non_finite_gaussians_keep_their_index_and_are_hidden(scene, tmp_path):
    centres = np.random.default_rng(0).normal([0, 0, 5], 1, (50, 3))
    centres[7, 1], opacities = np.nan, np.full(50, 0.9)
    scales = np.full((50, 3), -4.0)
    scales[9, 0] = np.inf
    node = load_splat(write_gaussians(tmp_path / "nan.ply", centres, opacities=opacities, log_scales=scales))
    arrays = splat_arrays(node)
    assert np.flatnonzero(~arrays.valid).tolist() == [7, 9]
    np.testing.assert_allclose(arrays.centres[[7, 9]], np.tile(centres[arrays.valid].mean(0), (2, 1)), atol=1e-5)
    assert arrays.opacities[[7, 9]].tolist() == [0, 0] and not shown_gaussians(node)[[7, 9]].any()
    assert [notice.code for notice in arrays.notices] == ["non_finite_gaussians"]
    assert np.isfinite(column(node, "scale")).all() and np.isfinite(column(node, "rotation")).all()


def test_points_without_opacity_are_opaque_and_it_is_said(scene, tmp_path):
    node = load_splat(write_points(tmp_path / "points.ply", np.random.default_rng(0).normal(size=(30, 3))))
    arrays = splat_arrays(node)
    assert (arrays.opacities == 1).all() and [notice.code for notice in arrays.notices] == ["no_opacity"]
    np.testing.assert_array_equal(column(node, "colour")[3], [3, 6, 9])
    np.testing.assert_array_equal(column(node, "scale"), 0)
    np.testing.assert_array_equal(column(node, "rotation"), np.tile([1, 0, 0, 0], (30, 1)))


def test_bad_files_leave_the_scene_as_it_was(scene, sample_case, tmp_path, scene_contents):
    whole = sample_case.splat.read_bytes()
    (tmp_path / "cut.ply").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text.ply").write_text("no ply\n")
    nothing = np.full((4, 3), np.nan)
    write_gaussians(tmp_path / "nothing.ply", nothing, opacities=np.full(4, 0.5), log_scales=np.zeros((4, 3)))
    before = scene_contents()
    for name, message in [
        ("cut.ply", "truncated"),
        ("text.ply", "not a PLY file"),
        ("missing.ply", "no such file"),
        ("nothing.ply", "is finite"),
    ]:
        with pytest.raises(InputError, match=message):
            load_splat(tmp_path / name)
    with pytest.raises(InputError, match="mm per unit"):
        load_splat(sample_case.splat, mm_per_unit=-1)
    assert scene_contents() == before


def test_what_is_no_splat_is_told(scene):
    mesh = scene.AddNewNodeByClass("vtkMRMLModelNode", "mesh")
    assert not is_splat(None) and not is_splat(mesh)
    for node, message in ((None, "none chosen"), (mesh, "mesh holds no Gaussians")):
        with pytest.raises(InputError, match=message):
            checked_splat(node)


def test_a_saved_scene_brings_the_splat_back(host, scene, sample_case, tmp_path):
    node = load_splat(sample_case.splat, mm_per_unit=25.0)
    before, shown, name = splat_arrays(node), shown_gaussians(node), node.GetName()
    fields = {field: column(node, field).copy() for field in ("scale", "rotation")}
    assert slicer.util.saveScene(str(tmp_path / "case.mrb"))
    host.clear_scene()
    slicer.util.loadScene(str(tmp_path / "case.mrb"))
    node = slicer.util.getNode(name)
    after = splat_arrays(node)
    for field in ("centres", "opacities", "colours", "valid"):
        np.testing.assert_array_equal(getattr(after, field), getattr(before, field))
    for field, values in fields.items():
        np.testing.assert_array_equal(column(node, field), values)
    np.testing.assert_array_equal(shown_gaussians(node), shown)
    np.testing.assert_allclose(T_world_scene(node), np.diag([25, 25, 25, 1]) @ UPRIGHT)
    bounds = np.zeros(6)
    node.GetRASBounds(bounds)
    placed = apply_matrix(T_world_scene(node), before.centres)
    np.testing.assert_allclose(bounds.reshape(3, 2), np.stack([placed.min(0), placed.max(0)], axis=1), atol=1e-3)
