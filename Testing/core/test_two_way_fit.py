"""Batches of poses and their two-way fit: derivatives by finite differences, known poses recovered."""

import numpy as np
import pytest
from scene_examples import POSE, bumpy_organ, seen_from_camera
from scipy.spatial.transform import Rotation

from organphys.align.pose_residuals import normal_equations
from organphys.align.poses import Poses, exp_rotation
from organphys.align.two_way_fit import TwoWayFit
from organphys.ground.frames import Similarity, rotation_about
from organphys.points.surface_samples import ClosestSampleGrid, sample_surface


def random_poses(count, seed=0):
    rng = np.random.default_rng(seed)
    rotation = Rotation.from_rotvec(rng.normal(size=(count, 3))).as_matrix()
    return Poses(rng.uniform(0.5, 2, count), rotation, rng.normal(size=(count, 3)))


@pytest.fixture(scope="module")
def setting():
    """Samples, view, fit and the true pose T_camera_normalised."""
    organ = bumpy_organ()
    samples = sample_surface(organ)
    view = seen_from_camera(organ).view()
    fit = TwoWayFit(samples, ClosestSampleGrid(samples.points), view, count=800)
    return fit, POSE @ samples.normalisation.T_ct_normalised, samples, view


def pose_errors(pose, truth):
    """Rotation in degrees and scale in percent."""
    turn = Rotation.from_matrix(pose.rotation @ truth.rotation.T).magnitude()
    return np.degrees(turn), 100 * abs(pose.scale / truth.scale - 1)


def twisted(pose, step):
    return Poses.of([pose]).source_twist(np.atleast_2d(step)).at(0)


def test_exp_rotation_matches_scipy():
    vectors = np.random.default_rng(0).normal(size=(20, 3)) * np.logspace(-12, 0.4, 20)[:, None]
    np.testing.assert_allclose(exp_rotation(vectors), Rotation.from_rotvec(vectors).as_matrix(), atol=1e-14)
    np.testing.assert_array_equal(exp_rotation(np.zeros((1, 3)))[0], np.eye(3))


def test_source_twist_changes_what_is_pulled_back():
    poses, step = random_poses(4), 0.3 * np.random.default_rng(1).normal(size=(4, 7))
    x = np.random.default_rng(2).normal(size=(10, 3))
    for k in range(4):
        rotation = Rotation.from_rotvec(step[k, :3]).as_matrix()
        changed = np.exp(step[k, 6]) * x @ rotation.T + step[k, 3:6]
        y = poses.at(k).apply(x)
        np.testing.assert_allclose(poses.source_twist(step).at(k).apply(changed), y, atol=1e-12)


def test_join_index_and_of():
    poses = random_poses(5)
    joined = Poses.join([poses[:2], poses[2:]])
    np.testing.assert_array_equal(joined.rotation, poses.rotation)
    again = Poses.of([poses.at(k) for k in range(5)])
    np.testing.assert_array_equal(again.translation, poses.translation)
    assert len(poses[np.array([True, False, True, False, False])]) == 2


def test_distinct_keeps_the_best_of_each_group():
    axis = np.array([0.0, 1.0, 0.0])
    turns = np.radians([0, 3, 20, 24, 180, 0])
    scales = np.array([1, 1, 1, 1, 1, 1.3])
    poses = Poses(scales, np.stack([rotation_about(axis, a) for a in turns]), np.zeros((6, 3)))
    score = np.array([0.5, 0.4, 0.9, 0.8, 0.1, 0.7])
    np.testing.assert_array_equal(poses.distinct(score, most=9, angle_deg=8.0), [4, 1, 5, 3])
    np.testing.assert_array_equal(poses.distinct(score, most=2, angle_deg=8.0), [4, 1])
    np.testing.assert_array_equal(poses.distinct(score, most=9, angle_deg=2.0), [4, 1, 0, 5, 3, 2])
    np.testing.assert_array_equal(poses.distinct(score, most=9, angle_deg=8.0, log_scale=0.5), [4, 1, 3])


def frozen_cost(rows, step):
    """1/2 sum w r^2 after the change x' = e^c exp(w) x + v of the source points, correspondences frozen."""
    point, normal = (np.stack(v, -1)[0].astype(np.float64) for v in (rows.point, rows.normal))
    plane = (point * normal).sum(1) - rows.residual[0]  # r = n (p - q), n q fixed
    moved = np.exp(step[6]) * point @ Rotation.from_rotvec(step[:3]).as_matrix().T + step[3:6]
    return 0.5 * (rows.weight[0] * ((moved * normal).sum(1) - plane) ** 2).sum()


@pytest.mark.parametrize("side", ["splat", "camera"])
def test_normal_equations_are_the_derivatives(setting, side):
    fit, truth, _, _ = setting
    off = twisted(truth, [0.1, -0.08, 0.12, 0.05, -0.03, 0.04, 0.05])
    rows = getattr(fit, f"_{side}_rows")(Poses.of([off]), 0.2)
    hessian, gradient = normal_equations(rows)
    eye, h = np.eye(7), 1e-4
    slope = [(frozen_cost(rows, h * e) - frozen_cost(rows, -h * e)) / (2 * h) for e in eye]
    np.testing.assert_allclose(gradient[0], slope, rtol=1e-3, atol=1e-3 * np.abs(slope).max())
    point, normal = (np.stack(v, -1)[0].astype(np.float64) for v in (rows.point, rows.normal))
    jacobian = np.column_stack([np.cross(point, normal), normal, (point * normal).sum(1)])
    np.testing.assert_allclose(hessian[0], jacobian.T @ (rows.weight[0][:, None] * jacobian), rtol=2e-3, atol=1e-2)


@pytest.mark.parametrize("side", ["splat", "camera"])
def test_residuals_at_the_true_pose_are_noise(setting, side):
    """Visible pairs agree to a few percent of the organ's radius (its rms radius is 1)."""
    fit, truth, _, _ = setting
    rows = getattr(fit, f"_{side}_rows")(Poses.of([truth]), 0.1)
    heavy = rows.weight[0] > 0.1 * rows.weight[0].max()
    assert heavy.sum() > 200
    assert np.median(np.abs(rows.residual[0][heavy])) < 0.02


def test_camera_residual_pushes_organ_out_of_empty_pixels(setting):
    """A pose shifted sideways has organ in empty pixels: its residual is the distance to the silhouette's plane."""
    fit, truth, _, view = setting
    shifted = Similarity(truth.scale, truth.rotation, truth.translation + np.array([0.6, 0, 0]))
    rows = fit._camera_rows(Poses.of([shifted]), 0.2)
    organ = shifted.apply(fit.organ_points[:3].T.astype(np.float64))
    i, j = np.clip(view.image.index(organ[:, :2] / organ[:, 2:]), 0, np.array(view.image.mask.shape) - 1).T
    empty = ~view.image.mask[i, j] & ~view.image.unknown[i, j]
    assert empty.sum() > 20
    normal = shifted.turn(np.stack(rows.normal, -1)[0][empty])
    point = shifted.apply(np.stack(rows.point, -1)[0][empty])
    np.testing.assert_allclose((normal * point).sum(1), 0, atol=1e-3)  # the plane holds the camera
    distance = (organ[empty] * normal).sum(1) / shifted.scale
    np.testing.assert_allclose(-rows.residual[0][empty], distance, atol=2e-3)


def test_score_is_lowest_at_the_truth(setting):
    fit, truth, _, _ = setting
    rng = np.random.default_rng(3)
    steps = rng.normal(size=(60, 7))
    steps *= np.array([1, 1, 1, 0.3, 0.3, 0.3, 0.3]) * 0.6
    wrong = Poses.of([twisted(truth, step) for step in steps])
    right = sum(fit.score(Poses.of([truth]), 0.12))
    assert right[0] < 0.2
    assert sum(fit.score(wrong, 0.12)).min() > right[0] + 0.02
    half_turns = Poses.of([twisted(truth, [*(np.pi * e), 0, 0, 0, 0]) for e in np.eye(3)])
    assert sum(fit.score(half_turns, 0.12)).min() > 0.5


def test_hiding_outside_the_view_is_no_way_out(setting):
    """An organ ten times too large covers the mask and all the unknown round it."""
    fit, truth, _, _ = setting
    huge = Similarity(10 * truth.scale, truth.rotation, truth.translation + np.array([0, 0, 10.0]))
    _, camera = fit.score(Poses.of([huge]), 0.12)
    assert camera[0] > 0.5


@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_rigid_copy_is_recovered_from_15_degrees_off(setting, axis):
    fit, truth, _, _ = setting
    poses = Poses.of([twisted(truth, [*(np.radians(15) * np.array(axis)), 0.05, -0.05, 0.05, 0.08])])
    assert pose_errors(poses.at(0), truth)[0] == pytest.approx(15, abs=0.1)
    for tau, damping in ((0.2, 0.02),) * 12 + ((0.1, 0.001),) * 12:
        poses = fit.step(poses, tau, damping=damping)
    angle, scale = pose_errors(poses.at(0), truth)
    assert angle < 0.5 and scale < 1.0


def test_known_scale_stays(setting):
    fit, truth, _, _ = setting
    poses = Poses.of([twisted(truth, [0.1, 0.05, 0, 0, 0, 0, 0.0])])
    stepped = fit.step(poses, 0.2, damping=0.02, free_scale=False)
    assert stepped.scale[0] == poses.scale[0]
    assert not np.array_equal(stepped.rotation, poses.rotation)


def test_batch_equals_one_at_a_time(setting):
    fit, truth, _, _ = setting
    rng = np.random.default_rng(0)
    poses = Poses.of([twisted(truth, 0.1 * rng.normal(size=7)) for _ in range(5)])
    together = fit.step(poses, 0.2, damping=0.02)
    for k in range(5):
        alone = fit.step(poses[k : k + 1], 0.2, damping=0.02)
        np.testing.assert_allclose(together.rotation[k], alone.rotation[0], atol=1e-4)
        np.testing.assert_allclose(together.scale[k], alone.scale[0], rtol=1e-4)
