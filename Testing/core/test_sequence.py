"""Following an organ through the splats of a sequence."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest
from scene_examples import bumpy_organ, map_error
from sequence_examples import seen_at, true_places
from session_examples import small_problem

from organphys.asset.sequence_file import load_sequence, save_sequence, sequence_bytes
from organphys.elastic.temporal_prior import TemporalPrior
from organphys.ground.checks import InputError
from organphys.pipeline.register import register
from organphys.pipeline.registration import RegisterOptions
from organphys.pipeline.sequence import SequenceFollower
from organphys.pipeline.tracking import FollowOptions
from organphys.points.point_sets import GaussianCloud

SHARES = (0.2, 0.35, 0.5, 0.65, 0.8)


@pytest.fixture(scope="module", autouse=True)
def small():
    with small_problem():
        yield


@pytest.fixture(scope="module")
def organ():
    return bumpy_organ()


@pytest.fixture(scope="module")
def clouds(organ):
    return [seen_at(organ, share, seed=k).cloud for k, share in enumerate(SHARES)]


@pytest.fixture(scope="module")
def started(organ, clouds):
    """The first frame, whose registration takes longest: goes on in copies."""
    run = SequenceFollower(organ)
    run.add(clouds[0], 0.0)
    return run


def going_on(started, follow=None):
    """A follower that has done the same frames; what it does next is its own."""
    run = copy.copy(started)
    run.frames, run.follow = list(started.frames), follow or started.follow
    return run


@pytest.fixture(scope="module")
def follower(started, clouds):
    run = going_on(started)
    for k, cloud in enumerate(clouds[1:], start=1):
        run.add(cloud, k / 25)
    return run


@pytest.fixture(scope="module")
def sequence(follower):
    return follower.sequence


def errors_mm(sequence, organ):
    points = organ.volume_points[::7]
    return [map_error(sequence.map_points(points, k), true_places(points, s)) for k, s in enumerate(SHARES)]


def test_every_frame_is_as_exact_as_a_registration_of_its_own(sequence, organ, clouds):
    followed = errors_mm(sequence, organ)
    points = organ.volume_points[::7]
    alone = register(organ, clouds[4]).organ  # the last frame: farthest from the one that was searched
    assert followed[4] < map_error(alone.map_points(points), true_places(points, SHARES[4])) + 0.5
    assert max(followed) < 4.0
    assert sequence.status == ("first", *["tracked"] * 4)
    np.testing.assert_allclose(sequence.scales, sequence.scales[0])  # the first frame's
    assert sequence.notices == ()


def test_frame_and_file_map_the_same_points(sequence, organ, tmp_path):
    save_sequence(sequence, tmp_path / "a.organphys-seq")
    loaded = load_sequence(tmp_path / "a.organphys-seq")
    for k in range(len(SHARES)):
        np.testing.assert_array_equal(loaded.map_points(organ.vertices, k), sequence.map_points(organ.vertices, k))
        np.testing.assert_allclose(loaded.scene_vertices(k), loaded.frame(k).scene_vertices, atol=1e-9)
    assert loaded.status == sequence.status and loaded.time_unit == "s"
    np.testing.assert_allclose(loaded.times, np.arange(5) / 25)
    assert loaded.figures.keys() == sequence.figures.keys()
    assert sequence_bytes(loaded) == sequence_bytes(sequence)
    assert loaded.frame(0).uncertainty is not None or sequence.organ.uncertainty is None
    assert loaded.frame(1).uncertainty is None


def test_broken_files_and_frames_are_told(sequence, tmp_path):
    path = tmp_path / "a.organphys-seq"
    save_sequence(sequence, path)
    with pytest.raises(InputError, match="0 to 4"):
        sequence.frame(5)
    with pytest.raises(InputError, match="0 to 4"):
        sequence.map_points(np.zeros((1, 3)), -1)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError):
        load_sequence(path)
    path.write_bytes(content.replace(b'"version": 1', b'"version": 9'))
    with pytest.raises(InputError):
        load_sequence(path)
    for wrong in ({"times": sequence.times[::-1]}, {"scales": -sequence.scales}, {"status": ("gone",) * 5}):
        with pytest.raises(InputError, match="sequence"):
            dataclasses.replace(sequence, **wrong)


def test_damping_takes_jitter_out_where_nothing_moves(organ):
    """The same state seen again with fresh noise: the stronger the damping, the calmer the organ."""
    clouds = [seen_at(organ, 0.5, seed=k, noise_mm=1.5).cloud for k in range(5)]
    moved, first = [], SequenceFollower(organ)
    first.add(clouds[0], 0.0)
    for damping in (0.0, 0.3):
        run = going_on(first, FollowOptions(damping=damping))
        for k, cloud in enumerate(clouds[1:], start=1):
            run.add(cloud, float(k))
        surfaces = np.stack([run.sequence.scene_vertices(k) for k in range(1, 5)])
        moved.append(np.linalg.norm(np.diff(surfaces, axis=0), axis=2).mean())
    assert moved[1] < 0.7 * moved[0]


def test_prior_holds_bending_but_not_rigid_motion(follower):
    organ = follower._method.organ
    rng = np.random.default_rng(0)
    z = 0.05 * rng.normal(size=(organ.basis.size, 3))
    prior = TemporalPrior.of(organ.basis, z, 2.0)
    shift = organ.basis.similarity_coordinates(np.zeros((3, 3)), rng.normal(size=3)).ravel()
    assert abs(shift @ prior.stiffness @ shift) < 1e-9 * (shift @ shift)
    bend = rng.normal(size=z.shape)
    moved = organ.basis.phi(organ.elasticity.points) @ bend
    cost = bend.ravel() @ prior.stiffness @ bend.ravel()
    assert 0 < cost <= 2.0 * (moved**2).sum(1).mean() * (1 + 1e-9)
    assert cost > 1.5 * (moved**2).sum(1).mean()  # little of random bending is rigid


def test_steady_motion_is_expected_to_go_on(clouds, started):
    """Where two frames were followed, the third begins nearer to where it ends, and not after an organ was lost."""
    run, view = going_on(started), started._method.view
    run.add(clouds[1], 1.0)
    stays, goes_on = run._seen_by(view), run._expected(view, 2.0)
    late = run._expected(view, 9.0)  # a gap: it goes on for one interval at most
    run.add(clouds[2], 2.0)
    reduced = run._method.organ
    assert late.pose.key == goes_on.pose.key != stays.pose.key
    end = run._seen_by(view)
    end_points = end.pose.apply(reduced.points(end.z))
    way = [np.linalg.norm(s.pose.apply(reduced.points(s.z)) - end_points, axis=1).mean() for s in (stays, goes_on)]
    assert way[1] < way[0]
    run.add(dataclasses.replace(clouds[2], valid=np.zeros(len(clouds[2]), dtype=bool)), 3.0)
    assert run._expected(view, 4.0).pose.key == run._seen_by(view).pose.key


def test_lost_organ_is_told_and_found_again(organ, clouds, started):
    far = clouds[2].centres + np.array([2.5, 0.5, 1.0], dtype=np.float32)  # 80 mm away: out of a warm start's reach
    jumped = dataclasses.replace(clouds[2], centres=far)
    run = going_on(started)
    frame = run.add(jumped, 1.0)
    assert frame.status == "restarted" and frame.lost
    points = organ.volume_points[::7]
    found = run.sequence.map_points(points, 1)
    assert map_error(found - np.array([2.5, 0.5, 1.0]), true_places(points, SHARES[2])) < 4.5
    assert [k for k, _ in run.sequence.notices] == [1]
    assert "found again" in run.sequence.notices[0][1]


def test_frame_without_an_organ_keeps_the_last_place(clouds, started):
    run = going_on(started, FollowOptions(restart=False))
    nothing = np.zeros(len(clouds[1].centres), dtype=bool)
    empty = GaussianCloud(clouds[1].centres, clouds[1].opacities, clouds[1].colours, nothing)
    frame = run.add(empty, 1.0)
    assert frame.status == "lost"
    np.testing.assert_allclose(frame.T_scene_ct.matrix, run.frames[0].T_scene_ct.matrix)
    assert run.add(clouds[1], 2.0).status == "tracked"


def test_inputs_that_cannot_be_used_are_told(organ, clouds, started):
    with pytest.raises(InputError, match="method"):
        SequenceFollower(organ, RegisterOptions(method="paper"))
    for wrong in ({"damping": -1.0}, {"scale_percent": np.nan}, {"steps": 0}):
        with pytest.raises(InputError):
            FollowOptions(**wrong)
    with pytest.raises(InputError, match="no frame"):
        _ = SequenceFollower(organ).sequence
    with pytest.raises(InputError, match="sort the frames"):
        going_on(started).add(clouds[1], 0.0)
