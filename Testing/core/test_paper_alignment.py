"""The paper's coarse and rigid stages on an asymmetric body with known pose."""

import numpy as np
import pytest

from organphys.align.paper_coarse import PaperCoarseOptions, oriented_box, paper_coarse, projected_diameter
from organphys.align.paper_rigid import PaperRigidOptions, hann_radius, hann_weights, paper_rigid
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, fit_similarity, rotation_about, rotation_between
from organphys.ground.progress import Cancelled
from organphys.ground.solve_report import Stop


def body(count=1500):
    """Surface points (N, 3) of a bent, asymmetric egg some 100 mm long, RAS mm, centroid away from zero."""
    k = np.arange(count) + 0.5
    height, angle = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - height**2)
    p = np.stack([height, ring * np.cos(angle), ring * np.sin(angle)], 1)
    p *= [50.0, 25.0, 15.0]
    p[:, 1] += 8 * (p[:, 0] / 50) ** 2
    p[:, 2] *= 1 + 0.5 * p[:, 0] / 50
    return p + np.array([100.0, -40.0, 7.0])


@pytest.fixture(scope="module")
def surface():
    return body()


@pytest.fixture(scope="module")
def landmarks(surface):
    """Two points on the +z side, so that the front is roughly +z."""
    centre = surface.mean(0)
    top = surface[np.argsort(np.linalg.norm(surface - centre - [22, 0, 16], axis=1))[0]]
    return np.stack([top, surface[np.argsort(np.linalg.norm(surface - centre - [-22, 0, 12], axis=1))[0]]])


def scene_pose(surface, landmarks, twist_deg, scale=0.02):
    """T_scene_ct whose front looks exactly at a camera in the origin, twisted about that axis."""
    centre, place = surface.mean(0), np.array([0.1, -0.2, 3.0])
    viewer = -place / np.linalg.norm(place)
    rotation = rotation_about(viewer, np.radians(twist_deg)) @ rotation_between(landmarks.mean(0) - centre, viewer)
    return Similarity(scale, rotation, place - scale * rotation @ centre)


@pytest.mark.parametrize("twist_deg", [0, 90, 240, 330])
def test_twist_search_finds_a_known_twist(surface, landmarks, twist_deg):
    target = scene_pose(surface, landmarks, twist_deg).apply(surface)
    found, view = paper_coarse(surface, target, landmarks, np.zeros(3))
    assert view.chosen_twist_deg == pytest.approx(twist_deg)
    assert len(view.twist_costs) == 12 and view.twist_costs.argmin() == twist_deg // 30 and view.margin > 0.2
    np.testing.assert_allclose(found.rotation, scene_pose(surface, landmarks, twist_deg).rotation, atol=1e-9)


def test_coarse_front_goes_to_the_viewer_and_centroids_meet(surface, landmarks):
    pose = scene_pose(surface, landmarks, 60)
    target = pose.apply(surface)
    found, view = paper_coarse(surface, target, landmarks, np.zeros(3))
    np.testing.assert_allclose(found.turn(view.front_ct), view.viewer_scene, atol=1e-12)
    np.testing.assert_allclose(found.apply(surface.mean(0)), target.mean(0), atol=1e-12)
    assert found.scale == pytest.approx(view.box_extent_scene / view.hull_diameter_mm)
    assert found.scale == pytest.approx(pose.scale, rel=0.03)
    np.testing.assert_allclose(np.linalg.det(found.rotation), 1)


def test_projected_diameter_and_oriented_box_of_a_box():
    corners = np.stack(np.meshgrid([-1.0, 1], [-2.0, 2], [-3.0, 3]), -1).reshape(-1, 3)
    segment, diameter = projected_diameter(corners, np.array([0.0, 0.0, 5.0]))
    assert diameter == pytest.approx(2 * np.sqrt(5))
    assert np.linalg.norm((segment[1] - segment[0])[:2]) == pytest.approx(diameter)
    rotation = rotation_about(np.array([1.0, 2.0, 3.0]), 0.8)
    points = np.concatenate([corners, np.diag([1.0, 2, 3]), -np.diag([1.0, 2, 3])]) @ rotation.T + [5, 6, 7]
    box, extent = oriented_box(points)
    assert extent == pytest.approx(6)
    expected = corners @ rotation.T + [5, 6, 7]
    assert max(np.linalg.norm(expected - corner, axis=1).min() for corner in box) < 1e-9


def test_coarse_bad_input(surface, landmarks):
    target = scene_pose(surface, landmarks, 0).apply(surface)
    with pytest.raises(InputError, match="landmarks"):
        paper_coarse(surface, target, surface.mean(0)[None], np.zeros(3))
    with pytest.raises(InputError, match="camera"):
        paper_coarse(surface, target, landmarks, target.mean(0))
    with pytest.raises(InputError, match="line"):
        paper_coarse(np.linspace([0, 0, 0], [1, 0, 0], 9), target, np.array([[0.5, 1, 0]]), np.zeros(3))


def test_hann_weights_known_values():
    points = np.array([[0.0, 0, 0], [2.5, 0, 0], [5.0, 0, 0], [7.5, 0, 0], [10.0, 0, 0], [30.0, 0, 0]])
    weights = hann_weights(points, np.array([[0.0, 0, 0]]), 10.0)
    half = 0.5 * np.sqrt(0.5)
    np.testing.assert_allclose(weights, [1, 0.5 + half, 0.5, 0.5 - half, 0, 0], atol=1e-12)
    two = hann_weights(points, np.array([[0.0, 0, 0], [10.0, 0, 0]]), 10.0)  # the nearest landmark counts
    np.testing.assert_allclose(two, [1, 0.5 + half, 0.5, 0.5 + half, 1, 0], atol=1e-12)


def test_hann_radius_is_the_distance_between_landmarks_or_half_the_diameter():
    assert hann_radius(np.array([[0.0, 0, 0], [3.0, 4.0, 0]]), 80.0) == (5.0, False)
    assert hann_radius(np.array([[1.0, 2, 3]]), 80.0) == (40.0, True)
    assert hann_radius(np.array([[1.0, 2, 3], [1.0, 2, 3]]), 80.0) == (40.0, True)


@pytest.mark.parametrize("count", [1, 2])
def test_rigid_recovers_a_rigid_copy_exactly(surface, landmarks, count):
    truth = scene_pose(surface, landmarks, 47)
    target, marks = truth.apply(surface), landmarks[:count]
    _, view = paper_coarse(surface, target, landmarks, np.zeros(3))
    nudge = rotation_about(np.array([1.0, 0.5, 0.2]), np.radians(1.5))  # within the point spacing of 3 mm
    start = Similarity(1.0, nudge, target.mean(0) - nudge @ target.mean(0) + np.array([0.01, 0, 0.006])) @ truth
    found = paper_rigid(
        surface, target, marks, coarse=start, view=view, options=PaperRigidOptions(iterations=400, tolerance=1e-9)
    )
    error = np.linalg.norm(found.T_scene_ct.apply(surface) - target, axis=1).max() / truth.scale
    assert error < 1e-6, f"{error} mm"
    assert found.report.stop is Stop.CONVERGED and found.single_landmark == (count == 1)
    assert found.start_costs_mm.min() < 1e-6 < np.sort(found.start_costs_mm)[1]


def test_rigid_keeps_the_scale_and_ignores_far_outliers(surface, landmarks):
    truth = scene_pose(surface, landmarks, 0)
    seen = (surface - surface.mean(0)) @ (landmarks.mean(0) - surface.mean(0)) > 0
    rng = np.random.default_rng(0)
    outliers = rng.uniform(-1, 1, (60, 3)) * 0.5 + truth.apply(surface).mean(0) + [3.0, 0, 0]
    target = np.concatenate([truth.apply(surface[seen]), outliers])
    _, view = paper_coarse(surface, truth.apply(surface), landmarks, np.zeros(3))
    shift = Similarity(1.0, np.eye(3), [0.03, 0.02, 0.01])
    found = paper_rigid(surface, target, landmarks, coarse=shift @ truth, view=view)
    assert found.T_scene_ct.scale == pytest.approx(truth.scale)
    error = np.linalg.norm(found.T_scene_ct.apply(surface[seen]) - truth.apply(surface[seen]), axis=1) / truth.scale
    assert error.mean() < 0.5


def test_bounded_search_changes_nothing(surface, landmarks):
    """One trimmed, weighted step written out plainly gives the same pose as the stage's first iteration."""
    truth = scene_pose(surface, landmarks, 10)
    target = truth.apply(surface)
    coarse, view = paper_coarse(surface, target, landmarks, np.zeros(3))
    options = PaperRigidOptions(starts=1, iterations=3)
    found = paper_rigid(surface, target, landmarks, coarse=coarse, view=view, options=options)
    weights = hann_weights(surface, landmarks, np.linalg.norm(landmarks[0] - landmarks[1]))
    moved, pose = coarse.apply(surface), coarse
    for _ in range(3):
        squared = ((moved[:, None] - target[None]) ** 2).sum(-1)
        kept = np.argsort(squared.min(1))[: len(surface) // 2]
        step = fit_similarity(moved[kept], target[squared.argmin(1)[kept]], weights[kept], scale=False)
        pose, moved = step @ pose, step.apply(moved)
    np.testing.assert_allclose(found.T_scene_ct.matrix, pose.matrix, atol=1e-10)


def test_rigid_says_when_the_kept_pairs_carry_no_weight(surface, landmarks):
    truth = scene_pose(surface, landmarks, 0)
    _, view = paper_coarse(surface, truth.apply(surface), landmarks, np.zeros(3))
    hidden = surface[np.argsort(np.linalg.norm(surface - landmarks[0], axis=1))[-200:]]
    near = np.stack([landmarks[0], landmarks[0] + [0.5, 0, 0]])
    found = paper_rigid(surface, truth.apply(hidden), near, coarse=truth, view=view)
    assert found.report.stop is Stop.NO_DATA


def test_stages_report_progress_and_can_be_cancelled(surface, landmarks):
    truth = scene_pose(surface, landmarks, 0)
    target, seen = truth.apply(surface), []
    options = PaperCoarseOptions(surface_points=300)
    _, view = paper_coarse(
        surface, target, landmarks, np.zeros(3), options=options, progress=lambda *call: seen.append(call)
    )
    paper_rigid(
        surface,
        target,
        landmarks,
        coarse=truth,
        view=view,
        progress=lambda stage, fraction: seen.append((stage, fraction)),
    )
    for stage in ("coarse", "rigid"):
        fractions = [fraction for name, fraction in seen if name == stage]
        assert fractions == sorted(fractions) and fractions[0] >= 0 and fractions[-1] == 1.0

    def cancel(stage, fraction):
        raise Cancelled

    with pytest.raises(Cancelled):
        paper_rigid(surface, target, landmarks, coarse=truth, view=view, progress=cancel)
