"""Landmarks clicked in the CT and on the splat: read, checked, and what they do to pose and shape."""

import json

import numpy as np
import pytest
from scene_examples import POSE, bend, bumpy_organ, seen_from_camera

from organphys.align.landmark_prior import STRONGEST, STRONGEST_PAIR, LandmarkPrior
from organphys.align.poses import Poses
from organphys.elastic.elastic_registration import ElasticState
from organphys.elastic.landmark_matches import FREE_MM, WEIGHT, landmark_matches
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, rotation_about
from organphys.pipeline.case import Case
from organphys.pipeline.commands_register import landmarks_of
from organphys.pipeline.landmark_checks import checked_partners
from organphys.pipeline.outer_loop import Changes
from organphys.points.point_sets import Landmarks
from organphys.points.surface_samples import sample_surface
from organphys.readers.landmark_pairs import paired_landmarks, read_landmark_pairs


def save(path, points, labels, system="LPS"):
    control = [{"label": name, "position": list(p)} for name, p in zip(labels, points, strict=True)]
    content = {"markups": [{"type": "Fiducial", "coordinateSystem": system, "controlPoints": control}]}
    path.write_text(json.dumps(content))
    return path


def test_pairs_are_matched_by_label(tmp_path):
    organ = save(tmp_path / "ct.mrk.json", [(1, 2, 3), (4, 5, 6), (7, 8, 9)], ("a", "b", "c"))
    splat = save(tmp_path / "splat.mrk.json", [(0.3, 0, 1), (0.1, 0.2, 1)], ("c", "a"), "RAS")
    landmarks = read_landmark_pairs(organ, splat)
    assert landmarks.pairs == (2, 0)
    np.testing.assert_array_equal(landmarks.points_ct[0], [-1, -2, 3])
    np.testing.assert_array_equal(landmarks.points_scene, [[0.3, 0, 1], [0.1, 0.2, 1]])


def test_pairs_without_common_labels_go_by_order():
    landmarks = read_landmark_pairs("1,2,3; 4,5,6", "0,0,1; 0,1,1")
    assert landmarks.pairs == (0, 1)
    named = Landmarks(np.zeros((2, 3)), ("F-1", "F-2"))
    assert paired_landmarks(named, Landmarks(np.ones((2, 3)), ("S-1", "S-2"))).pairs == (0, 1)
    with pytest.raises(InputError, match="3 for 2 landmarks"):
        paired_landmarks(named, Landmarks(np.ones((3, 3)), ("S-1", "S-2", "S-3")))


def test_command_line_takes_pairs():
    assert landmarks_of(None, None) is None
    assert landmarks_of("1,2,3", None).points_scene is None
    np.testing.assert_array_equal(landmarks_of("1,2,3", "0.5,0,1").points_scene, [[0.5, 0, 1]])
    with pytest.raises(InputError, match="--landmarks"):
        landmarks_of(None, "0.5,0,1")


@pytest.fixture(scope="module")
def setting():
    """The bent organ, what is seen of it, and tissue that is seen: its place in the CT and in the scene."""
    organ = bumpy_organ()
    seen = seen_from_camera(organ, deformation=bend)
    moved = np.linalg.norm(bend(seen.points_ct) - seen.points_ct, axis=1)
    at = seen.points_ct[[int(moved.argmax()), int(moved.argmin())]]
    return organ, seen, at, POSE.apply(bend(at))


def test_partners_are_checked(setting):
    _, seen, at, places = setting
    found = checked_partners(Landmarks(at, (), places[1:], (1,)), seen.points)
    assert np.isnan(found[0]).all()
    np.testing.assert_array_equal(found[1], places[1])
    assert checked_partners(None, seen.points).shape == (0, 3)
    assert np.isnan(checked_partners(Landmarks(at), seen.points)).all()
    bad = places.copy()
    bad[0, 1] = np.nan
    for wrong, match in (
        (Landmarks(at, (), places[:1]), "1 for 2"),
        (Landmarks(at, (), bad), "on the splat"),
        (Landmarks(at, ("tip", "notch"), places + np.array([[0, 0, 0], [0, 9, 0]])), "landmark notch lies .* off"),
        (Landmarks(at, (), places, (0, 2)), "pairs"),
        (Landmarks(at, (), places, (1, 1)), "pairs"),
    ):
        with pytest.raises(InputError, match=match):
            checked_partners(wrong, seen.points)


def test_case_and_its_changes_carry_the_partners(setting):
    organ, seen, at, places = setting
    case = Case.of(organ, seen.cloud, landmarks=Landmarks(at, (), places))
    np.testing.assert_array_equal(case.partners, places)
    assert case.facts["landmarks"] == "2, 2 of them also on the splat"
    changed = Changes(landmarks=Landmarks(at[:1])).case(case)
    assert changed.partners.shape == (1, 3) and np.isnan(changed.partners).all()


def prior_of(setting, places, view):
    samples = sample_surface(setting[0])
    return samples, LandmarkPrior.of(setting[2], samples, partners=view.T_camera_scene.apply(places))


def test_a_pair_tells_poses_apart_and_forgives_ten_millimetres(setting):
    _, seen, _, places = setting
    view = seen.view()
    samples, prior = prior_of(setting, places, view)
    truth = view.T_camera_scene @ POSE @ samples.normalisation.T_ct_normalised
    turned = truth @ Similarity(1.0, rotation_about(np.array([0.0, 0, 1]), np.pi / 2), np.zeros(3))
    right, wrong = prior.cost(Poses.of([truth, turned]), view)
    assert right < 0.16 and wrong > right + 0.15  # one of the places moved by 17 mm as the organ bent
    _, off = prior_of(setting, places + np.array([[10.0, 0, 0], [0, 10.0, 0]]) * POSE.scale, view)
    assert off.cost(Poses.of([truth]), view)[0] < wrong - 0.1
    assert prior.cost(Poses.of([turned]), view)[0] <= STRONGEST + STRONGEST_PAIR


def test_landmark_without_partner_costs_what_it_did(setting):
    _, seen, at, places = setting
    view, samples = seen.view(), sample_surface(setting[0])
    poses = Poses.of([view.T_camera_scene @ POSE @ samples.normalisation.T_ct_normalised])
    alone = LandmarkPrior.of(at, samples).cost(poses, view)
    unknown = LandmarkPrior.of(at, samples, partners=np.full_like(places, np.nan)).cost(poses, view)
    np.testing.assert_array_equal(alone, unknown)


def test_matches_pull_the_landmark_itself_to_its_place(setting, reduced):
    """At the rest pose the pull is the displacement of the landmark, not of the sample next to it, less 10 mm."""
    _, seen, at, places = setting
    view = seen.view()
    samples, prior = prior_of(setting, places, view)
    start = view.T_camera_scene @ POSE @ samples.normalisation.T_ct_normalised
    shape = ElasticState(np.zeros((reduced.basis.size, 3)), 1.0, start).deformed(reduced)
    matches = landmark_matches(samples, shape, prior)
    pull = matches.targets - shape.points[matches.rows]
    moved = np.linalg.norm(bend(at) - at, axis=1, keepdims=True)
    expected = (bend(at) - at) * np.clip(1 - FREE_MM / moved, 0, None) / samples.normalisation.length
    assert (moved > FREE_MM).any()
    np.testing.assert_allclose(pull, expected, atol=1e-6)
    assert 0.5 * WEIGHT < matches.weights.sum() <= WEIGHT and (matches.plane == 0).all()
    assert len(landmark_matches(samples, shape, None).rows) == 0


@pytest.fixture(scope="module")
def reduced(setting):
    from organphys.elastic.reduced_organ import reduce_organ

    return reduce_organ(setting[0], sample_surface(setting[0]))
