"""A Slicer ROI round the shown splat as a box in scene units."""

from __future__ import annotations

import numpy as np
import pytest
import vtk

from organphys import InputError
from organphys.ground.frames import rotation_about
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, array_of, matrix_of
from OrganPhysRegistrationLib.inputs.roi_input import scene_box
from OrganPhysRegistrationLib.inputs.splat_node import T_shown_scene, load_splat, scene_to_world, splat_arrays

SIZE = np.array([60.0, 40.0, 30.0])


@pytest.fixture
def splat(scene, sample_case):
    return load_splat(sample_case.splat, mm_per_unit=25)


@pytest.fixture
def roi(scene, splat):
    """An oblique box round the middle of the splat, in the world."""
    node = scene.AddNewNodeByClass("vtkMRMLMarkupsROINode", "crop")
    pose = np.eye(4)
    pose[:3, :3] = rotation_about(np.array([1.0, -1.0, 0.5]), 0.6)
    pose[:3, 3] = apply_matrix(T_shown_scene(splat), np.median(splat_arrays(splat).centres, axis=0))
    node.SetSize(*SIZE)
    node.SetAndObserveObjectToNodeMatrix(matrix_of(pose))
    return node


def linear(scene, rotation, shift, scale=1.0):
    node, matrix = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode"), np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * rotation, shift
    node.SetMatrixTransformToParent(matrix_of(matrix))
    return node


def inside_by_slicer(roi, splat):
    """(N,) bool: by the ROI node's own idea of the world (its planes would leave out scaling parents)."""
    points = apply_matrix(T_shown_scene(splat), splat_arrays(splat).centres)
    T_object_world = np.linalg.inv(array_of(roi.GetObjectToWorldMatrix()))
    return (np.abs(apply_matrix(T_object_world, points)) <= np.array(roi.GetSize()) / 2).all(axis=1)


def test_box_holds_what_the_roi_holds(scene, splat, roi):
    turn = rotation_about(np.array([0.0, 1.0, 0.3]), -0.5)
    roi.SetAndObserveTransformNodeID(linear(scene, turn, [4, 5, 6], 1.2).GetID())
    scene_to_world(splat).SetAndObserveTransformNodeID(linear(scene, turn, [10, 5, 0], 1.1).GetID())
    box = scene_box(roi, splat)
    np.testing.assert_allclose(box.size, SIZE * 1.2 / (25 * 1.1))
    inside = box.contains(splat_arrays(splat).centres.astype(float))
    assert 100 < inside.sum() < len(inside)
    np.testing.assert_array_equal(inside, inside_by_slicer(roi, splat))


def test_no_roi_is_no_box(splat):
    assert scene_box(None, splat) is None


def test_bad_input_says_what_to_do(scene, splat, roi):
    with pytest.raises(InputError, match="not placed yet"):
        scene_box(scene.AddNewNodeByClass("vtkMRMLMarkupsROINode", "new"), splat)
    with pytest.raises(InputError, match="is no ROI"):
        scene_box(splat, splat)
    with pytest.raises(InputError, match="none chosen"):
        scene_box(roi, None)
    roi.SetAndObserveTransformNodeID(linear(scene, np.diag([1.0, 2.0, 1.0]), [0, 0, 0]).GetID())
    with pytest.raises(InputError, match="sheared"):
        scene_box(roi, splat)
    bent = scene.AddNewNodeByClass("vtkMRMLTransformNode", "bent")
    bent.SetAndObserveTransformToParent(vtk.vtkThinPlateSplineTransform())
    roi.SetAndObserveTransformNodeID(bent.GetID())
    with pytest.raises(InputError, match="bent is not linear"):
        scene_box(roi, splat)
