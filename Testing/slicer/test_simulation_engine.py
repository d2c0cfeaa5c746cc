"""Parts of the running simulation that need no scene: axes of covariances, the surface's stretch, the arm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from simulation_example import example_organ

from organphys.simulation.body import Body
from organphys.simulation.instruments import INSTRUMENTS
from organphys.simulation.organ_body import organ_body
from organphys.simulation.psm import Psm
from OrganPhysSimulationLib.engine.arm import JAW_SPEED, TIP_SPEED, ArmState, moved
from OrganPhysSimulationLib.engine.covariance_axes import axes_of, turned
from OrganPhysSimulationLib.engine.surface_motion import SurfaceMotion
from OrganPhysSimulationLib.views.splat_cloud import SplatCloud


@pytest.fixture(scope="module")
def body() -> Body:
    return organ_body(example_organ(), handles=8, quadrature=300, sample_spacing=4e-3)


def matrices(quaternions):
    return Rotation.from_quat(np.asarray(quaternions)[:, [1, 2, 3, 0]]).as_matrix()


def test_axes_give_the_covariances_back():
    rng = np.random.default_rng(0)
    turns, sizes = Rotation.random(2000, random_state=1).as_matrix(), np.exp(rng.normal(size=(2000, 3)))
    covariances = (turns * sizes[:, None, :] ** 2) @ turns.transpose(0, 2, 1)
    deviations, quaternions = axes_of(covariances.astype(np.float32))
    found = matrices(quaternions)
    again = (found * deviations[:, None, :] ** 2) @ found.transpose(0, 2, 1)
    error = np.abs(again - covariances).max((1, 2)) / np.abs(covariances).max((1, 2))
    assert error.max() < 1e-4
    assert np.allclose(np.sort(deviations), np.sort(sizes), rtol=1e-2)


def test_axes_of_flat_and_empty_gaussians_are_finite():
    covariances = np.zeros((3, 3, 3), dtype=np.float32)
    covariances[1, 0, 0], covariances[2] = 4, np.diag([1, 4, 9])
    deviations, quaternions = axes_of(covariances)
    assert np.isfinite(quaternions).all()
    assert deviations[1, 0] == pytest.approx(2)
    assert np.sort(deviations[2]) == pytest.approx([1, 2, 3])
    by = Rotation.from_rotvec([0.1, -0.4, 0.7])
    assert np.allclose(
        matrices(turned(quaternions, by.as_quat()[[3, 0, 1, 2]])), by.as_matrix() @ matrices(quaternions)
    )


def test_surface_moves_as_the_body_does(body):
    z = 2e-3 * np.random.default_rng(2).normal(size=(body.basis.size, 3))
    motion = SurfaceMotion.of(body)
    assert np.abs(motion.rest + motion.displacement(body, z) - body.vertices(z)).max() < 1e-7  # m


def test_stretch_of_a_surface_stretched_along_one_axis(body):
    motion = SurfaceMotion.of(body)
    assert np.abs(motion.stretch(motion.rest)).max() < 1e-4
    stretched = motion.stretch(motion.rest * [1.2, 1.0, 1.0])
    side = np.abs(motion.rest[:, 0] - motion.rest[:, 0].mean()) < 0.01  # where x lies in the surface
    assert stretched[side] == pytest.approx(0.2, abs=0.01)
    assert stretched.max() < 0.201
    turn = Rotation.from_rotvec([0.3, 0.2, -0.5]).as_matrix()
    assert np.abs(motion.stretch(motion.rest @ turn.T)).max() < 1e-4


def test_normals_point_outwards(body):
    motion = SurfaceMotion.of(body)
    outwards = motion.rest - motion.rest.mean(0)
    assert (np.einsum("ij,ij->i", motion.normals(motion.rest), outwards) > 0).all()


def test_arm_keeps_to_its_speeds_and_arrives():
    psm = Psm(INSTRUMENTS["large_needle_driver"], np.eye(4))
    now, wanted = ArmState(psm.home, 40.0), ArmState(psm.home + np.array([0.3, -0.2, 0.05, 1.0, 0.2, 0.1]), -10.0)
    dt, places, jaws = 1 / 60, [psm.forward(now.joints, 0).position], [now.jaw_deg]
    for _ in range(120):
        now = moved(psm, now, wanted, dt)
        places.append(psm.forward(now.joints, 0).position)
        jaws.append(now.jaw_deg)
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1) / dt
    assert speed.max() < 1.1 * TIP_SPEED  # an arc is a little longer than its chord
    assert np.abs(np.diff(jaws)).max() <= JAW_SPEED * dt + 1e-9
    assert np.allclose(now.joints, wanted.joints) and now.jaw_deg == wanted.jaw_deg


def test_cloud_is_ordered_from_far_to_near_and_scaled_with_the_splat():
    arrays = {
        "centres": np.float32([[0, 0, 1], [0, 0, 3], [0, 0, 2]]),
        "scale": np.full((3, 3), 0.1, np.float32),
        "rotation": np.tile(np.float32([1, 0, 0, 0]), (3, 1)),
        "colour": np.zeros((3, 3), np.uint8),
        "opacity": np.ones(3, np.float32),
    }
    cloud = SplatCloud(arrays, np.arange(3))
    assert cloud.order(np.array([0.0, 0, 1])).tolist() == [1, 2, 0]
    matrix = np.diag([50.0, 50, 50, 1])
    cloud.place(matrix)
    assert cloud.deviations == pytest.approx(5.0)
    assert cloud.positions[1] == pytest.approx([0, 0, 150])
