"""Frames, similarities and their least-squares fit: exact answers."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from organphys.ground.checks import InputError
from organphys.ground.frames import (
    Normalisation,
    Similarity,
    cross_matrix,
    fit_similarity,
    ras_from_lps,
    rotation_about,
    rotation_between,
)

T_B_A = Similarity(0.03, rotation_about(np.array([1.0, -2.0, 0.5]), 2.0), np.array([0.4, -1.0, 3.0]))
T_C_B = Similarity(7.0, rotation_about(np.array([0.0, 1.0, 4.0]), -0.6), np.array([-5.0, 2.0, 1.0]))


@pytest.fixture
def points():
    return np.random.default_rng(0).normal(size=(30, 3)) * [3.0, 2.0, 1.0] + [10.0, -4.0, 2.0]


def test_lps_to_ras_turns_the_first_two_axes_and_is_its_own_inverse(points):
    np.testing.assert_array_equal(ras_from_lps([1.0, 2.0, 3.0]), [-1, -2, 3])
    np.testing.assert_array_equal(ras_from_lps(ras_from_lps(points)), points)


def test_compose_inverse_and_matrix_agree(points):
    np.testing.assert_allclose((T_C_B @ T_B_A).apply(points), T_C_B.apply(T_B_A.apply(points)), atol=1e-12)
    np.testing.assert_allclose((T_C_B @ T_B_A).matrix, T_C_B.matrix @ T_B_A.matrix, atol=1e-12)
    np.testing.assert_allclose(T_B_A.inverse().apply(T_B_A.apply(points)), points, atol=1e-12)
    np.testing.assert_allclose(T_B_A.inverse().matrix @ T_B_A.matrix, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(T_B_A.apply(points[3]), T_B_A.apply(points)[3], atol=1e-15)
    np.testing.assert_array_equal(Similarity.identity().apply(points), points)


def test_turn_keeps_lengths_and_ignores_translation(points):
    turned = T_B_A.turn(points)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(points, axis=1))
    np.testing.assert_allclose(T_B_A.scale * turned, T_B_A.apply(points) - T_B_A.apply(np.zeros(3)), atol=1e-12)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_impossible_scale_is_refused(scale):
    with pytest.raises(InputError, match="scale"):
        Similarity(scale, np.eye(3), np.zeros(3))


def test_normalisation_is_undone_and_is_a_similarity(points):
    normalisation = Normalisation(np.array([1.0, 2.0, 3.0]), 40.0)
    x = normalisation.apply(points)
    np.testing.assert_allclose(x[0], (points[0] - [1, 2, 3]) / 40)
    np.testing.assert_allclose(normalisation.undo(x), points)
    np.testing.assert_allclose(normalisation.T_ct_normalised.apply(x), points)


def test_rotation_about_and_cross_matrix_match_scipy():
    axis, angle = np.array([1.0, 2.0, -0.5]), 1.9
    expected = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    np.testing.assert_allclose(rotation_about(axis, angle), expected, atol=1e-14)
    np.testing.assert_allclose(cross_matrix(axis) @ [0.3, -1, 2], np.cross(axis, [0.3, -1, 2]), atol=1e-15)


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-7, 1e-6, 1e-5, 1e-3, 1.0, 3.0])
def test_rotation_between_also_near_opposite_directions(gap):
    """``gap``: angle short of half a turn."""
    source = np.array([0.2, -1.0, 0.7])
    side = np.cross(source, [1.0, 0, 0])
    target = 5 * rotation_about(side, np.pi - gap) @ source
    rotation = rotation_between(source, target)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(rotation) == pytest.approx(1)
    turned = rotation @ source / np.linalg.norm(source)
    np.testing.assert_allclose(turned, target / np.linalg.norm(target), atol=2e-8)
    assert np.degrees(Rotation.from_matrix(rotation).magnitude()) == pytest.approx(np.degrees(np.pi - gap), abs=1e-4)


def test_fit_recovers_a_similarity_exactly(points):
    found = fit_similarity(points, T_B_A.apply(points))
    np.testing.assert_allclose(found.matrix, T_B_A.matrix, atol=1e-12)
    rigid = Similarity(1.0, T_B_A.rotation, T_B_A.translation)
    np.testing.assert_allclose(
        fit_similarity(points, rigid.apply(points), scale=False).matrix, rigid.matrix, atol=1e-12
    )


def test_fit_stays_proper_for_mirrored_data(points):
    found = fit_similarity(points, points * [1.0, 1.0, -1.0])
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    # the best proper answer: no random neighbour of it is better
    best = ((found.apply(points) - points * [1, 1, -1]) ** 2).sum()
    rng = np.random.default_rng(1)
    for _ in range(50):
        turn = Rotation.from_rotvec(0.05 * rng.normal(size=3)).as_matrix()
        centre = found.apply(points).mean(0)
        factor = 1 + 0.02 * rng.normal()
        moved = factor * (found.apply(points) - centre) @ turn.T + centre
        assert ((moved - points * [1, 1, -1]) ** 2).sum() > best


def test_fit_honours_weights(points):
    target = T_B_A.apply(points)
    target[0] += 5.0
    weights = np.ones(len(points))
    weights[0] = 0
    np.testing.assert_allclose(fit_similarity(points, target, weights).matrix, T_B_A.matrix, atol=1e-12)
    assert np.abs(fit_similarity(points, target).matrix - T_B_A.matrix).max() > 0.01
    # weight 2 is the same as the point twice
    weights = np.ones(len(points))
    weights[0] = 2
    twice = fit_similarity(np.vstack([points, points[:1]]), np.vstack([target, target[:1]]))
    np.testing.assert_allclose(fit_similarity(points, target, weights).matrix, twice.matrix, atol=1e-12)
