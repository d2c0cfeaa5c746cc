"""Registering again after a small change: as a full run, but only what the change touches is computed."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from scene_examples import POSE, bend, bumpy_organ, seen_from_camera
from session_examples import tiny_problem

from organphys.elastic.elastic_registration import SEEN_TAU, ElasticOptions
from organphys.elastic.matches import Deformed
from organphys.elastic.visibility import visibility
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, rotation_about
from organphys.ground.progress import Cancelled
from organphys.pipeline import default_method
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.session import RegistrationSession
from organphys.points.point_sets import Landmarks, SceneUnit


@pytest.fixture(scope="module", autouse=True)
def small():
    with tiny_problem():
        yield


@pytest.fixture(scope="module")
def organ():
    return bumpy_organ(rings=28, around=48, voxel_mm=5.0)


@pytest.fixture(scope="module")
def seen(organ):
    return seen_from_camera(organ, deformation=bend, count=4500)


@pytest.fixture(scope="module")
def landmark(organ):
    return Landmarks(organ.vertices[[np.argmin(POSE.apply(organ.vertices)[:, 2])]], ("front",))


@pytest.fixture(scope="module")
def registered(organ, seen, landmark):
    run = RegistrationSession(organ, seen.cloud, landmarks=landmark)
    run.elastic()
    return run


@pytest.fixture
def session(registered):
    return copy.copy(registered)  # its state is never changed, only replaced


def full_run(organ, seen, landmarks, **options):
    run = RegistrationSession(organ, seen.cloud, RegisterOptions(**options), landmarks=landmarks)
    return run.elastic()


def distance_mm(one, other):
    return float(np.linalg.norm(one.surfaces["elastic"] - other.surfaces["elastic"], axis=1).max() * one.mm_per_unit)


@pytest.mark.parametrize("stiffness", [0.03, "aggressive"])
def test_stiffness_gives_what_a_full_run_gives(organ, seen, landmark, session, stiffness):
    before = session.elastic()
    outcome = session.updated(stiffness=stiffness)
    expected = full_run(organ, seen, landmark, stiffness=stiffness)
    assert distance_mm(outcome, expected) < 1e-6 < distance_mm(outcome, before)
    np.testing.assert_allclose(outcome.det_f, expected.det_f, atol=1e-4)
    left_out = {name for name in expected.metrics["elastic"] if name.startswith("error_")}
    assert left_out and outcome.metrics["elastic"].keys() == expected.metrics["elastic"].keys() - left_out
    assert outcome.stops == expected.stops
    settled = session.settled()
    assert outcome.asset is None and settled.asset == expected.asset
    assert outcome.steps == () and settled.steps == expected.steps
    assert settled.metrics["elastic"].keys() == expected.metrics["elastic"].keys()
    for name in left_out:
        assert settled.metrics["elastic"][name]["value"] == pytest.approx(expected.metrics["elastic"][name]["value"])
    assert settled.verdict["level"] == expected.verdict["level"]


def test_stiffness_gives_what_a_full_run_gives_where_little_is_seen(organ, seen, landmark):
    """The data weigh less then, by a share that must not depend on which levels are run again."""
    cloud, across = seen.cloud, seen.cloud.centres[:, 0]
    half = replace(cloud, valid=cloud.valid & (across < np.median(across)))
    run = RegistrationSession(organ, half, landmarks=landmark)
    run.elastic()
    method, pose = run.default_method, run.state.stages["rigid"].pose
    shape = Deformed(method.organ.samples.points, method.organ.samples.normals, 1.0, pose)
    assert visibility(shape, method.view, SEEN_TAU).front.mean() < ElasticOptions().seen_share
    outcome = run.updated(stiffness=0.02)
    expected = RegistrationSession(organ, half, RegisterOptions(stiffness=0.02), landmarks=landmark).elastic()
    assert distance_mm(outcome, expected) < 1e-6


def test_stiffness_runs_its_own_level_only(session, monkeypatch):
    levels = []
    solve = default_method.register_elastically
    monkeypatch.setattr(
        default_method,
        "register_elastically",
        lambda *args, **named: levels.append(named["options"].levels) or solve(*args, **named),
    )
    session.updated(stiffness=0.021)
    session.updated(stiffness="moderate")  # known from the first run
    assert [[level.alpha for level in run] for run in levels] == [[0.021]]


def test_moved_landmark_needs_no_search(organ, seen, landmark, session, monkeypatch):
    session.prepare_updates()
    monkeypatch.setattr(default_method, "search_start", None)  # would fail if it were called
    moved = Landmarks(landmark.positions + np.array([6.0, -4.0, 3.0]), landmark.names)
    outcome = session.updated(landmarks=moved)
    monkeypatch.undo()
    with tiny_problem():
        expected = full_run(organ, seen, moved)
        assert distance_mm(outcome, expected) < 0.5
        settled = session.settled()
    assert distance_mm(settled, expected) < 1e-6
    assert settled.asset


def test_landmark_on_the_far_side_gives_another_pose_and_coming_back_the_first(organ, landmark, session):
    first = session.elastic()
    session.prepare_updates()
    offsets = organ.vertices - organ.vertices.mean(0)
    behind = np.argmin(offsets @ (landmark.positions[0] - organ.vertices.mean(0)))
    other = session.updated(landmarks=Landmarks(organ.vertices[[behind]], ("behind",)))
    assert distance_mm(other, first) > 10  # every pose that shows the first landmark hides this one
    assert distance_mm(session.updated(landmarks=landmark), first) < 1e-6


def test_unit_is_a_full_run_of_its_own(organ, seen, landmark, session):
    outcome = session.updated(unit=SceneUnit(30.0))
    expected = RegistrationSession(organ, seen.cloud, landmarks=landmark, unit=SceneUnit(30.0)).elastic()
    assert distance_mm(outcome, expected) < 1e-6
    assert outcome.unit_stated


def test_pose_set_by_hand_stays(session, landmark):
    T_scene_ct = Similarity(POSE.scale, rotation_about(np.ones(3), 0.05) @ POSE.rotation, POSE.translation)
    by_hand = session.elastic(start=T_scene_ct)
    session.updated(stiffness=0.03)
    again = session.updated(stiffness="moderate", landmarks=landmark)
    assert distance_mm(again, by_hand) < 1e-6


def test_bad_change_and_cancelling_leave_the_session_as_it_was(session):
    state = session.state
    with pytest.raises(InputError, match="stiffness"):
        session.updated(stiffness=7.0)
    with pytest.raises(InputError, match="stiffness"):
        session.updated(stiffness="soft")
    with pytest.raises(InputError, match="RAS and LPS"):
        session.updated(landmarks=Landmarks(np.array([[900.0, 0.0, 0.0]])))

    def cancel(name, fraction):
        raise Cancelled

    with pytest.raises(Cancelled):
        session.updated(cancel, stiffness=0.03)
    assert session.state is state


def test_update_before_the_elastic_stage_runs_it(organ, seen, landmark, registered):
    run = RegistrationSession(organ, seen.cloud, landmarks=landmark)
    assert distance_mm(run.updated(stiffness="moderate"), registered.elastic()) < 1e-6


def test_paper_method_takes_presets_only(organ, seen, landmark):
    run = RegistrationSession(organ, seen.cloud, RegisterOptions(method="paper"), landmarks=landmark)
    with pytest.raises(InputError, match="stiffness"):
        run.updated(stiffness=0.03)


def test_landmark_known_on_the_splat_is_fitted_anew(organ, seen, session):
    """A pair pulls at the organ: elastic fits without it must not be taken for those with it."""
    row = int(np.argmin(seen.points[:, 2]))
    pair = Landmarks(seen.points_ct[[row]], ("pair",), points_scene=seen.points[[row]])
    outcome = session.updated(landmarks=pair)
    with tiny_problem():
        settled = session.settled()
        assert distance_mm(settled, full_run(organ, seen, pair)) < 1e-6
    assert distance_mm(outcome, settled) < 3.0
