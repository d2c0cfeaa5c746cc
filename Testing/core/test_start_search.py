"""The global start: known poses found from nothing, the landmark prior, and the candidates."""

import numpy as np
import pytest
from scene_examples import FRONT_CT, MM_PER_UNIT, POSE, Seen, bumpy_organ, seen_from_camera
from scipy.spatial.transform import Rotation

from organphys.align.landmark_prior import STRONGEST, LandmarkPrior
from organphys.align.pose_view import pose_view
from organphys.align.poses import Poses
from organphys.align.start_candidates import CandidateOptions, fibonacci_sphere, start_candidates
from organphys.align.start_search import SearchStage, Starts, StartSearchOptions, search_start
from organphys.ground.frames import Similarity, rotation_about
from organphys.ground.progress import Cancelled
from organphys.points.surface_samples import sample_surface

QUICK = StartSearchOptions(
    candidates=CandidateOptions(views=60, twists=12, factors=(0.95, 1.2)),
    stages=(
        SearchStage(points=50, steps=3, tau=0.35, damping=0.05, batch=600, keep=100, apart_deg=8.0),
        SearchStage(points=300, steps=8, tau=0.15, damping=0.01, batch=20),
    ),
)


@pytest.fixture(scope="module")
def setting():
    """Samples, view and the true pose T_camera_normalised."""
    organ = bumpy_organ()
    samples = sample_surface(organ)
    return samples, seen_from_camera(organ).view(), POSE @ samples.normalisation.T_ct_normalised


@pytest.fixture(scope="module")
def starts(setting):
    return search_start(*setting[:2])


def pose_errors(pose, truth):
    """Rotation in degrees and scale in percent."""
    turn = Rotation.from_matrix(pose.rotation @ truth.rotation.T).magnitude()
    return np.degrees(turn), 100 * abs(pose.scale / truth.scale - 1)


def seen_landmark(samples, sign=1.0):
    """A CT point (1, 3) mm in the middle of the seen side, or of the hidden one."""
    row = (samples.points @ (sign * FRONT_CT)).argmax()
    return samples.normalisation.undo(samples.points[row : row + 1])


def test_known_pose_is_found_without_landmarks(setting, starts):
    angle, scale = pose_errors(starts.poses.at(0), setting[2])
    assert angle < 2.0 and scale < 3.0
    assert (np.diff(starts.scores) >= 0).all() and starts.scores[0] < 0.3
    assert starts.candidates == 150 * 18 * 4


def test_pose_is_found_though_half_of_the_splat_is_cut_away(setting):
    """The whole organ must be accepted beyond the cut, or smaller and turned organs fit what is left better."""
    samples, _, truth = setting
    seen = seen_from_camera(bumpy_organ())
    plane = seen.points[:, :2] / seen.points[:, 2:]
    half = Seen(*(rows[plane[:, 0] > np.median(plane[:, 0])] for rows in (seen.points, seen.points_ct)))
    angle, scale = pose_errors(search_start(samples, half.view()).poses.at(0), truth)
    assert angle < 8.0 and scale < 8.0


def test_modes_are_distinct_and_near_the_best(starts):
    modes = starts.modes(most=5, margin=0.25, apart_deg=8.0)
    assert 1 <= len(modes.poses) <= 5 and modes.scores[0] == starts.scores[0]
    assert (modes.scores <= modes.scores[0] + 0.25).all()
    for i in range(len(modes.poses)):
        for j in range(i):
            a, b = modes.poses.at(i), modes.poses.at(j)
            assert pose_errors(a, b)[0] > 8.0 or abs(np.log(a.scale / b.scale)) > 0.08


def test_modes_leave_out_the_bad_and_the_like():
    turns = [rotation_about(np.array([0, 0, 1.0]), np.radians(a)) for a in (0, 2, 90, 180)]
    poses = Poses(np.ones(4), np.stack(turns), np.zeros((4, 3)))
    modes = Starts(poses, np.array([0.3, 0.31, 0.5, 0.6]), 4).modes()
    np.testing.assert_array_equal(modes.scores, [0.3, 0.5])


def test_given_scale_is_kept_exactly(setting):
    samples, view, truth = setting
    found = search_start(samples, view, scale=truth.scale, options=QUICK)
    assert (found.poses.scale == truth.scale).all()
    assert pose_errors(found.poses.at(0), truth)[0] < 3.0


def test_same_seed_same_bits(setting):
    samples, view, _ = setting
    first, again = (search_start(samples, view, options=QUICK, seed=5) for _ in range(2))
    np.testing.assert_array_equal(first.poses.rotation, again.poses.rotation)
    np.testing.assert_array_equal(first.poses.translation, again.poses.translation)
    np.testing.assert_array_equal(first.scores, again.scores)
    other = search_start(samples, view, options=QUICK, seed=6)
    assert not np.array_equal(first.scores, other.scores)


def test_cancelling_is_passed_on(setting):
    def cancel(stage, fraction):
        raise Cancelled

    with pytest.raises(Cancelled):
        search_start(*setting[:2], options=QUICK, progress=cancel)


def test_fibonacci_sphere_is_even():
    points = fibonacci_sphere(150)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1)
    np.testing.assert_allclose(points.mean(0), 0, atol=0.01)
    cosine = points @ points.T - 2 * np.eye(150)
    nearest = np.degrees(np.arccos(cosine.max(1)))
    assert nearest.min() > 12 and nearest.max() < 20  # 16.6 degrees is the edge of 150 equal cells


def test_candidates_cover_the_true_view_and_twist(setting):
    samples, view, truth = setting
    found = start_candidates(samples, view)
    errors = [pose_errors(found.poses.at(k), truth) for k in range(len(found.poses))]
    angle, scale = np.array(errors).T
    near = angle < 20
    assert near.any() and scale[near].min() < 10
    low, high = found.scale_range
    assert low < truth.scale < high


def test_candidates_face_the_camera_and_lie_on_the_splat(setting):
    samples, view, _ = setting
    options = CandidateOptions(views=7, twists=5, factors=(1.0,))
    poses = start_candidates(samples, view, options=options).poses
    np.testing.assert_allclose(np.linalg.det(poses.rotation), 1)
    squared = poses.rotation @ poses.rotation.transpose(0, 2, 1)
    np.testing.assert_allclose(squared, np.tile(np.eye(3), (35, 1, 1)), atol=1e-12)
    to_camera = -view.surface.centre / np.linalg.norm(view.surface.centre)
    fronts = (poses.rotation.transpose(0, 2, 1) @ to_camera).reshape(7, 5, 3)
    np.testing.assert_allclose(fronts, fronts[:, :1].repeat(5, 1), atol=1e-12)  # twists keep the view direction
    for k in range(5):
        between = poses.rotation[k] @ poses.rotation[0].T
        assert Rotation.from_matrix(between).magnitude() == pytest.approx(min(k, 5 - k) * 2 * np.pi / 5)
    # the organ's centre lies behind the seen surface
    assert (np.linalg.norm(poses.translation, axis=1) > 0.98 * np.linalg.norm(view.surface.samples.mean(0))).all()


def test_landmark_drops_views_that_cannot_see_it(setting):
    samples, view, _ = setting
    normal = np.array([[0.0, 0.6, 0.8]])
    poses = start_candidates(samples, view, landmark_normals=normal).poses
    to_camera = -view.surface.centre / np.linalg.norm(view.surface.centre)
    cosine = (poses.rotation.transpose(0, 2, 1) @ to_camera) @ normal[0]
    assert cosine.min() >= -0.1 - 1e-9
    assert 0.5 < len(poses) / (150 * 18 * 4) < 0.6  # 55 % of a sphere
    # landmarks that no view can see together are not followed
    opposite = np.vstack([normal, -normal, [[1.0, 0, 0]], [[-1.0, 0, 0]], [[0, 0.8, -0.6]], [[0, -0.8, 0.6]]])
    assert len(start_candidates(samples, view, landmark_normals=opposite).poses) == 150 * 18 * 4


def test_landmark_cost_is_zero_where_it_is_seen_and_bounded(setting):
    samples, view, truth = setting
    poses = Poses.of([truth, truth @ Similarity(1.0, rotation_about(np.array([1.0, 0, 0]), np.pi), np.zeros(3))])
    seen = LandmarkPrior.of(seen_landmark(samples), samples).cost(poses, view)
    hidden = LandmarkPrior.of(seen_landmark(samples, -1.0), samples).cost(poses, view)
    assert seen[0] == 0 and hidden[0] == pytest.approx(STRONGEST)
    assert (seen <= STRONGEST).all() and seen[1] > 0.1
    none = LandmarkPrior.of(np.zeros((0, 3)), samples)
    np.testing.assert_array_equal(none.cost(poses, view), [0, 0])
    assert len(none) == 0


def test_landmark_distance_counts_beyond_its_radius(setting):
    """Shifted away from the camera by d: cost 3 (d - 0.15) times the strongest."""
    samples, view, truth = setting
    prior = LandmarkPrior.of(seen_landmark(samples), samples)
    ray = truth.apply(prior.positions)[0]
    ray /= np.linalg.norm(ray)
    shifts = truth.scale * np.array([0.1, 0.3, 0.4])
    poses = Poses.of([Similarity(truth.scale, truth.rotation, truth.translation + s * ray) for s in shifts])
    cost = prior.cost(poses, view) / STRONGEST
    assert cost[0] == 0
    assert cost[2] - cost[1] == pytest.approx(0.3, abs=0.06)


def test_landmark_picks_between_views(setting):
    """A landmark on the side that was not seen makes its true pose worse than it is without."""
    samples, view, _ = setting
    hidden = LandmarkPrior.of(seen_landmark(samples, -1.0), samples)
    best = search_start(samples, view, landmarks=hidden, options=QUICK).poses.at(0)
    to_camera = -view.surface.centre / np.linalg.norm(view.surface.centre)
    assert hidden.normals[0] @ best.rotation.T @ to_camera > -0.2


def test_pose_view_tells_the_true_front_and_twist(setting):
    samples, view, truth = setting
    told = pose_view(truth, samples, view)
    assert np.degrees(np.arccos(told.front_ct @ FRONT_CT / np.linalg.norm(FRONT_CT))) < 8
    assert told.twists_deg[told.twist_costs.argmin()] == told.chosen_twist_deg == 0.0
    length = np.linalg.norm(np.diff(told.hull_segment_ct, axis=0))
    assert told.hull_diameter_mm == pytest.approx(length, rel=0.02)
    assert 100 < told.hull_diameter_mm < 200
    assert (np.asarray(told.box_extent_scene) < 200 / MM_PER_UNIT).all()
