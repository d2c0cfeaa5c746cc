"""A registration stage by stage: the same as in one go, repeatable, with poses set by hand, never half changed."""

import numpy as np
import pytest
from scene_examples import FRONT_CT, MM_PER_UNIT, POSE, bend, bumpy_organ, map_error, seen_from_camera
from session_examples import small_problem

from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, rotation_about
from organphys.ground.progress import Cancelled
from organphys.pipeline.landmark_weights import landmark_weights
from organphys.pipeline.live_surface import LiveSurface
from organphys.pipeline.register import register
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.session import RegistrationSession
from organphys.points.point_sets import Landmarks, SceneUnit

STAGES = ("before", "coarse", "rigid", "elastic")


@pytest.fixture(scope="module", autouse=True)
def small():
    with small_problem():
        yield


@pytest.fixture(scope="module")
def organ():
    return bumpy_organ()


@pytest.fixture(scope="module")
def seen(organ):
    return seen_from_camera(organ, deformation=bend)


@pytest.fixture(scope="module")
def landmark(organ):
    return Landmarks(organ.vertices[[(organ.vertices @ FRONT_CT).argmax()]])


@pytest.fixture(scope="module")
def in_stages(organ, seen):
    """A session run stage by stage, its outcomes, and the surfaces shown during the elastic one."""
    session, shown = RegistrationSession(organ, seen.cloud), []
    outcomes = [session.coarse(), session.rigid(), session.elastic(on_surface=shown.append)]
    return session, outcomes, shown


@pytest.fixture
def session(in_stages):
    """The same session with all stages done; what a test does to it is taken back."""
    state = in_stages[0].state
    yield in_stages[0]
    in_stages[0].state = state


def turned(pose, *, degrees, shift_mm, scale=1.0):
    """``pose`` = T_scene_ct turned about the organ's centre and shifted."""
    centre = pose.apply(bumpy_organ(rings=12, around=18, voxel_mm=12.0).vertices.mean(0))
    rotation = rotation_about(np.array([1.0, 2.0, -1.0]), np.radians(degrees))
    shift = np.array([shift_mm, 0.0, 0.0]) * pose.scale
    return Similarity(scale, rotation, centre - scale * rotation @ centre + shift) @ pose


def angle_deg(a, b):
    return np.degrees(np.arccos(np.clip((np.trace(a.rotation.T @ b.rotation) - 1) / 2, -1, 1)))


def test_stages_in_a_row_are_register(organ, seen, session):
    whole, staged = register(organ, seen.cloud), session.registration
    for name in STAGES:
        np.testing.assert_array_equal(staged.similarities[name].matrix, whole.similarities[name].matrix)
    np.testing.assert_array_equal(staged.organ.z, whole.organ.z)
    np.testing.assert_array_equal(staged.vertex_distance_mm, whole.vertex_distance_mm)
    assert staged.metrics == whole.metrics and staged.notices == whole.notices and staged.facts == whole.facts
    assert list(staged.seconds) == list(whole.seconds) and staged.steps == whole.steps


def test_outcomes_hold_the_stages_done_and_no_more(organ, seen, in_stages):
    for done, outcome in zip((2, 3, 4), in_stages[1], strict=True):
        names = STAGES[:done]
        assert outcome.stage == names[-1]
        assert tuple(outcome.similarities) == tuple(outcome.surfaces) == tuple(outcome.distance_mm) == names
        assert tuple(outcome.metrics) == tuple(outcome.stops) == names[1:]
        for name in names[1:]:
            mean = outcome.metrics[name]["mean_ct_to_splat"]
            assert outcome.distance_mm[name].mean() == pytest.approx(mean["value"], rel=0.1) and mean["unit"] == "mm"
        if outcome.stage != "elastic":
            assert outcome.asset is None and outcome.det_f is None and outcome.volume_scene is None
    outcome = in_stages[1][-1]
    np.testing.assert_array_equal(outcome.surfaces["elastic"], in_stages[0].registration.organ.scene_vertices)
    np.testing.assert_allclose(
        outcome.volume_scene, in_stages[0].registration.organ.map_points(outcome.volume_ct), atol=1e-9
    )
    assert outcome.mm_per_unit == pytest.approx(MM_PER_UNIT, rel=0.06) and not outcome.unit_stated
    assert outcome.displacement_mm.shape == outcome.det_f.shape == (len(organ.vertices),)
    assert len(outcome.steps) == len(in_stages[0].registration.steps) and outcome.steps[0]["alpha"] > 0


def test_live_surface_ends_near_the_registered_one(in_stages):
    session, outcomes, shown = in_stages
    assert shown and all(s.shape == outcomes[-1].vertices_ct.shape for s in shown)
    samples, moved = session._method.organ.samples, session.registration.organ
    rest = samples.normalisation.undo(samples.points)
    final = LiveSurface(outcomes[-1].vertices_ct, lambda points: None).vertices(rest, moved.map_points(rest))
    assert np.linalg.norm(final - moved.scene_vertices, axis=1).max() * MM_PER_UNIT < 0.6


def test_live_surface_is_shown_five_times_a_second_at_most(organ):
    shown = []
    live = LiveSurface(organ.vertices, shown.append)
    for _ in range(5):
        live(organ.vertices[::9], POSE.apply(organ.vertices[::9]))
    assert len(shown) == 1
    np.testing.assert_allclose(shown[0], POSE.apply(organ.vertices), atol=1e-9)


def test_hand_set_pose_is_refined_close_by_and_told(seen, session):
    automatic, start = session.state.similarities["rigid"], turned(POSE, degrees=15, shift_mm=12, scale=1.08)
    outcome = session.rigid(start=start)
    found = session.state.similarities["rigid"]
    assert angle_deg(found, start) < 35
    truth = POSE.apply(bend(seen.points_ct))
    errors = [map_error(pose.apply(seen.points_ct), truth) for pose in (automatic, found, start)]
    assert errors[1] < 1.05 * errors[0] and errors[1] < 0.9 * errors[2]
    assert outcome.facts["start of the rigid stage"] == "set by hand"


def test_a_wrong_hand_set_pose_is_not_carried_off(session):
    """Upside down, far from any good fit: the user's basin is kept, not the automatic pose."""
    start = turned(POSE, degrees=150, shift_mm=0)
    session.rigid(start=start)
    assert angle_deg(session.state.similarities["rigid"], start) < 35


def test_exact_unit_sets_the_scale_of_a_hand_set_pose(organ, seen):
    session = RegistrationSession(organ, seen.cloud, unit=SceneUnit(MM_PER_UNIT))
    session.rigid(start=turned(POSE, degrees=5, shift_mm=3, scale=1.2))
    assert session.state.similarities["rigid"].scale == pytest.approx(1 / MM_PER_UNIT)


def test_elastic_alone_starts_at_a_hand_set_pose_as_it_is(organ, seen):
    session = RegistrationSession(organ, seen.cloud)
    start = turned(POSE, degrees=4, shift_mm=3)
    outcome = session.elastic(start=start)
    np.testing.assert_array_equal(outcome.similarities["rigid"], start.matrix)
    assert "set by hand" in outcome.stops["rigid"] and outcome.facts["start of the elastic stage"] == "set by hand"
    truth = POSE.apply(bend(seen.points_ct))
    assert map_error(session.registration.organ.map_points(seen.points_ct), truth) < 3.5


def test_stage_run_again_drops_what_came_after_it(in_stages, session):
    outcome = session.rigid()
    assert tuple(outcome.surfaces) == ("before", "coarse", "rigid") and outcome.asset is None
    with pytest.raises(InputError, match="run it first"):
        _ = session.registration
    again = session.elastic()
    np.testing.assert_array_equal(again.surfaces["elastic"], in_stages[1][-1].surfaces["elastic"])


@pytest.mark.parametrize("stage", ["coarse", "rigid", "elastic"])
def test_cancelled_stage_leaves_the_session_as_it_was(session, stage):
    before = session.state

    def cancel(name, fraction):
        if name == stage and fraction > 0:
            raise Cancelled

    with pytest.raises(Cancelled):
        session.advance(stage, cancel)
    assert session.state is before


def test_paper_method_in_stages_with_a_hand_set_pose(organ, seen, landmark):
    options, shown = RegisterOptions(method="paper", stiffness="conservative", landmark_radius_mm=45.0), []
    session = RegistrationSession(organ, seen.cloud, options, landmarks=landmark)
    start = turned(POSE, degrees=6, shift_mm=4)
    session.coarse()
    rigid = session.rigid(start=start)
    assert angle_deg(session.state.similarities["rigid"], start) < 15
    assert session.state.similarities["rigid"].scale == pytest.approx(start.scale)
    assert "single_landmark" not in [code for code, _ in rigid.notices]  # the user chose the radius
    outcome = session.elastic(on_surface=shown.append)
    assert shown and outcome.asset and outcome.det_f.min() > 0


def test_landmark_radius_is_used_by_the_default_method(organ, seen, landmark):
    session = RegistrationSession(organ, seen.cloud, RegisterOptions(landmark_radius_mm=30.0), landmarks=landmark)
    outcome = session.rigid()
    assert "single_landmark" not in [code for code, _ in outcome.notices]
    prior = session._method.landmarks
    assert prior.radius * session._method.samples.normalisation.length == pytest.approx(30.0)
    with pytest.raises(InputError, match="landmark radius"):
        RegisterOptions(landmark_radius_mm=0.0)


def test_landmark_weights_are_those_of_the_paper():
    points = np.array([[0.0, 0, 0], [10, 0, 0], [20, 0, 0], [40, 0, 0], [0, 8, 0]])
    weights, radius = landmark_weights(points, [[0, 0, 0]], 20.0)
    assert radius == 20.0
    np.testing.assert_allclose(weights, [1, 0.5, 0, 0, 0.5 * (1 + np.cos(0.4 * np.pi))], atol=1e-12)
    assert landmark_weights(points, [[0, 0, 0], [0, 0, 30]])[1] == 30.0  # between the landmarks
    assert landmark_weights(points, [[0, 0, 0]], None, 50.0)[1] == 25.0  # half of the extent
    ball = np.random.default_rng(0).normal(size=(4000, 3))
    ball *= 30 / np.linalg.norm(ball, axis=1, keepdims=True)
    assert landmark_weights(ball, ball[:1])[1] == pytest.approx(30.0, rel=0.02)  # half of the diameter seen


@pytest.mark.parametrize(
    "matrix",
    [np.eye(3), np.diag([1.0, 1, -1, 1]), np.diag([1.0, 2, 1, 1]), np.full((4, 4), np.nan), np.zeros((4, 4))],
)
def test_what_is_no_similarity_is_refused(matrix):
    with pytest.raises(InputError, match="pose"):
        Similarity.of_matrix(matrix)


def test_similarity_of_its_matrix():
    again = Similarity.of_matrix(POSE.matrix * (1 + 1e-9))
    np.testing.assert_allclose(again.matrix, POSE.matrix, atol=1e-8)
    assert np.linalg.det(again.rotation) == pytest.approx(1)
