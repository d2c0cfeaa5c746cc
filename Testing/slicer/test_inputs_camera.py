"""The endoscope as a 3D view and back: place, angle, upright and not mirrored."""

from __future__ import annotations

import numpy as np
import pytest
import slicer
from PIL import Image
from splat_files import write_gaussians

from organphys import InputError
from organphys.ground.frames import rotation_about
from OrganPhysRegistrationLib.inputs.camera_input import camera_from_view, look_from_endoscope
from OrganPhysRegistrationLib.inputs.matrices import ROLE, matrix_of
from OrganPhysRegistrationLib.inputs.splat_display import set_point_size
from OrganPhysRegistrationLib.inputs.splat_node import T_shown_scene, load_splat, scene_to_world

FOV = 70.0


@pytest.fixture
def camera(scene):
    return slicer.app.layoutManager().threeDWidget(0).threeDView().cameraNode()


@pytest.fixture
def splat(scene, sample_case):
    """The sample splat, moved about by an overlay frame as after a registration."""
    node = load_splat(sample_case.splat, mm_per_unit=25)
    frame, moved = scene.AddNewNodeByClass("vtkMRMLLinearTransformNode"), np.eye(4)
    frame.SetAttribute(ROLE, "overlay_frame")
    moved[:3, :3] = 0.9 * rotation_about(np.array([1.0, 2.0, -1.0]), 0.8)
    moved[:3, 3] = [30, -20, 10]
    frame.SetMatrixTransformToParent(matrix_of(moved))
    scene_to_world(node).SetAndObserveTransformNodeID(frame.GetID())
    return node


def test_there_and_back(splat, camera):
    for aspect in (1.6, 0.7):
        look_from_endoscope(splat, camera, fov_deg=FOV, aspect=aspect)
        position, fov_deg = camera_from_view(splat, camera, aspect=aspect)
        np.testing.assert_allclose(position, 0, atol=1e-9)
        assert fov_deg == pytest.approx(FOV)
    view = slicer.app.layoutManager().threeDWidget(0).mrmlViewNode()
    look_from_endoscope(splat, view, position=[0.5, -0.2, -1.0], fov_deg=FOV)
    np.testing.assert_allclose(camera_from_view(splat, view)[0], [0.5, -0.2, -1.0], atol=1e-9)


def test_angle_is_that_of_the_shorter_side(splat, camera):
    look_from_endoscope(splat, camera, fov_deg=FOV, aspect=1.6)
    assert camera.GetViewAngle() == pytest.approx(FOV)  # VTK's angle is the height's
    look_from_endoscope(splat, camera, fov_deg=FOV, aspect=0.5)
    assert np.tan(np.radians(camera.GetViewAngle() / 2)) == pytest.approx(2 * np.tan(np.radians(FOV / 2)))
    camera.GetCamera().SetUseHorizontalViewAngle(True)
    camera.SetViewAngle(110)
    height = 2 * np.degrees(np.arctan(np.tan(np.radians(55)) / 1.6))
    assert camera_from_view(splat, camera, aspect=1.6)[1] == pytest.approx(height)
    camera.GetCamera().SetUseHorizontalViewAngle(False)


def test_view_that_does_not_show_the_splat_tells_no_angle(splat, camera):
    look_from_endoscope(splat, camera, fov_deg=20)
    position, fov_deg = camera_from_view(splat, camera)
    np.testing.assert_allclose(position, 0, atol=1e-9)
    assert fov_deg == 0


def test_axes_are_those_of_the_endoscope(splat, camera):
    look_from_endoscope(splat, camera)
    turn = T_shown_scene(splat)[:3, :3]
    turn = turn / np.cbrt(np.linalg.det(turn))
    forward = np.array(camera.GetFocalPoint()) - camera.GetPosition()
    np.testing.assert_allclose(forward / np.linalg.norm(forward), turn @ [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(camera.GetViewUp(), turn @ [0, -1, 0], atol=1e-9)


def test_picture_is_the_endoscopes_own(scene, camera, tmp_path, view_png):
    """Three coloured spots land where an OpenCV pinhole camera puts them: upright, not mirrored."""
    rng = np.random.default_rng(0)
    spots = {(255, 0, 0): (-0.8, -0.5, 4.0), (0, 255, 0): (0.9, -0.2, 5.0), (0, 0, 255): (-0.3, 0.8, 4.5)}
    centres = np.concatenate([rng.normal(0, 0.02, (800, 3)) + spot for spot in spots.values()])
    colours = np.repeat(np.array(list(spots)) / 255, 800, axis=0)
    opacities, log_scales = np.full(len(centres), 0.9), np.zeros_like(centres)
    path = write_gaussians(tmp_path / "spots.ply", centres, opacities=opacities, log_scales=log_scales, colours=colours)
    splat = load_splat(path, mm_per_unit=30)
    set_point_size(splat, 4)
    look_from_endoscope(splat, camera, fov_deg=FOV)
    picture = np.asarray(Image.open(view_png("endoscope_spots", fit=False)).convert("RGB")).astype(int)
    height, width = picture.shape[:2]
    focal = min(height, width) / 2 / np.tan(np.radians(FOV / 2))
    for colour, (x, y, z) in spots.items():
        rows, columns = np.nonzero(np.abs(picture - colour).max(axis=2) < 8)
        assert len(rows) > 20, colour
        expected = width / 2 + focal * x / z, height / 2 + focal * y / z
        np.testing.assert_allclose([columns.mean() + 0.5, rows.mean() + 0.5], expected, atol=3)  # pixels


def test_bad_input_says_what_to_do(splat, camera):
    with pytest.raises(InputError, match="no 3D view"):
        camera_from_view(splat, None)
    with pytest.raises(InputError, match="none chosen"):
        look_from_endoscope(None, camera)
    with pytest.raises(InputError, match="camera position"):
        look_from_endoscope(splat, camera, position=[0, 0])
    camera.SetParallelProjection(True)
    with pytest.raises(InputError, match="perspective"):
        camera_from_view(splat, camera)
    camera.SetParallelProjection(False)
