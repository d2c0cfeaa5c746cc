"""Landmarks: read in the world, kept on the organ, told when misplaced; their weights as colours."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
import vtk
from scipy.spatial import cKDTree
from vtkmodules.util.numpy_support import vtk_to_numpy

from organphys import InputError
from OrganPhysRegistrationLib.inputs.landmark_input import (
    landmark_messages,
    landmark_points,
    organ_surface,
    show_weights,
    snap_to_surface,
)

LIVER = "Segment_5"
RADIUS = 50.0


@pytest.fixture
def sphere():
    source = vtk.vtkSphereSource()
    source.SetRadius(RADIUS)
    source.SetThetaResolution(120)
    source.SetPhiResolution(120)
    source.Update()
    return source.GetOutput()


@pytest.fixture
def landmarks(scene):
    return scene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "F")


@pytest.fixture
def segmentation(scene, sample_case):
    return slicer.util.loadSegmentation(str(sample_case.labels))


def positions(node):
    return np.array([node.GetNthControlPointPositionWorld(k) for k in range(node.GetNumberOfControlPoints())])


def test_points_are_read_in_the_world(scene, landmarks):
    transform = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode")
    matrix = vtk.vtkMatrix4x4()
    matrix.SetElement(0, 3, 100)
    transform.SetMatrixTransformToParent(matrix)
    landmarks.SetAndObserveTransformNodeID(transform.GetID())
    landmarks.AddControlPoint([1, 2, 3], "left lobe")
    landmarks.AddControlPoint([4, 5, 6], "")
    landmarks.AddControlPoint([7, 8, 9], "third")
    landmarks.UnsetNthControlPointPosition(1)
    found, names = landmark_points(landmarks)
    np.testing.assert_allclose(found, [[101, 2, 3], [107, 8, 9]])
    assert names == ["left lobe", "third"]
    for nothing in (None, scene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode")):
        found, names = landmark_points(nothing)
        assert found.shape == (0, 3) and names == []


def test_placed_and_moved_points_stay_on_the_surface(landmarks, sphere):
    landmarks.AddControlPoint([60, 0, 0])
    snapping = snap_to_surface(landmarks, sphere)
    landmarks.AddControlPoint([0, 30, 0])
    np.testing.assert_allclose(np.linalg.norm(positions(landmarks), axis=1), RADIUS, atol=0.1)
    landmarks.SetNthControlPointPositionWorld(0, 0, 0, 65)
    np.testing.assert_allclose(positions(landmarks)[0], [0, 0, RADIUS], atol=0.1)
    assert [landmarks.GetNthControlPointLabel(k) for k in range(2)] == ["Landmark 1", "Landmark 2"]
    snapping.remove()
    landmarks.SetNthControlPointPositionWorld(0, 0, 0, 65)
    np.testing.assert_allclose(positions(landmarks)[0], [0, 0, 65])


def test_names_given_by_the_user_stay(landmarks, sphere):
    landmarks.AddControlPoint([60, 0, 0], "falciform ligament")
    snap_to_surface(landmarks, sphere).remove()
    assert landmarks.GetNthControlPointLabel(0) == "falciform ligament"


def test_far_points_are_not_moved_but_told(landmarks, sphere):
    snapping = snap_to_surface(landmarks, sphere)
    landmarks.AddControlPoint([95, 0, 0])
    np.testing.assert_allclose(positions(landmarks), [[95, 0, 0]])
    (message,) = landmark_messages(landmarks, sphere)
    assert "Landmark 1 lies 45 mm from the organ's surface" in message
    landmarks.SetNthControlPointPositionWorld(0, 70, 0, 0)
    assert landmark_messages(landmarks, sphere) == []
    snapping.remove()


def test_too_many_and_coinciding_points_are_told(landmarks, sphere):
    for point in ([50, 0, 0], [50, 0.2, 0], [0, 50, 0]):
        landmarks.AddControlPoint(point)
    same, many = landmark_messages(landmarks, sphere)
    assert "at the same place" in same and "first 2 of 3" in many
    assert landmark_messages(None, sphere) == []


def test_weights_are_coloured_on_the_organ_and_leave_no_trace(segmentation, landmarks, scene_contents):
    before = scene_contents()
    surface = vtk_to_numpy(organ_surface(segmentation, LIVER).GetPoints().GetData()).astype(float)
    landmarks.AddControlPoint(surface[0])
    shown = show_weights(segmentation, LIVER, landmarks, 40.0)
    mesh = shown.node.GetPolyData()
    weights = vtk_to_numpy(mesh.GetPointData().GetScalars())
    distance = np.linalg.norm(surface - surface[0], axis=1)
    hann = np.where(distance < 40, 0.5 * (1 + np.cos(np.pi * distance / 40)), 0)
    np.testing.assert_allclose(weights, hann, atol=1e-3)
    assert cKDTree(surface).query(vtk_to_numpy(mesh.GetPoints().GetData()))[0].max() < 0.5  # mm
    legend = slicer.modules.colors.logic().GetColorLegendDisplayNode(shown.node)
    assert legend.GetTitleText() == "Landmark weight" and shown.node.GetDisplayNode().GetScalarVisibility()
    again = show_weights(segmentation, LIVER, landmarks)
    assert again.node is shown.node and again.radius_mm > 0 and shown.radius_mm == 40
    assert not again.node.GetSaveWithScene()
    again.remove()
    again.remove()
    assert scene_contents() == before


def test_bad_input_says_what_to_do(segmentation, landmarks):
    with pytest.raises(InputError, match="none placed"):
        show_weights(segmentation, LIVER, landmarks)
    with pytest.raises(InputError, match="no point list"):
        snap_to_surface(None, organ_surface(segmentation, LIVER))
    with pytest.raises(InputError, match="no surface"):
        snap_to_surface(landmarks, vtk.vtkPolyData())
