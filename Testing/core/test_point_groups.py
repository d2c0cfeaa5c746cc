"""Groups of points around places: as lists from the tree and numpy's mean and median say."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from organphys.points import point_groups
from organphys.points.point_groups import PointGroups

RADIUS = 0.3


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(0).uniform(size=(400, 2))


@pytest.fixture(scope="module")
def places():
    return np.vstack([np.random.default_rng(1).uniform(size=(40, 2)), [[9.0, 9.0]]])  # the last one is alone


@pytest.fixture(scope="module")
def lists(points, places):
    return cKDTree(points).query_ball_point(places, RADIUS)


@pytest.fixture(scope="module")
def groups(points, places):
    return PointGroups.within(cKDTree(points), places, RADIUS)


def test_every_pair_is_there(groups, lists):
    for k, members in enumerate(lists):
        assert sorted(groups.member[groups.place == k]) == sorted(members)
    np.testing.assert_array_equal(groups.sizes, [len(members) for members in lists])


def test_many_places_are_ordered_as_few(groups, points, places, monkeypatch):
    monkeypatch.setattr(point_groups, "SHORT", 10)
    same = PointGroups.within(cKDTree(points), places, RADIUS)
    np.testing.assert_array_equal(same.place, groups.place)
    np.testing.assert_array_equal(same.member, groups.member)


def test_means(groups, lists, points):
    expected = [points[members].mean(0) if members else np.zeros(2) for members in lists]
    np.testing.assert_allclose(groups.mean(points), expected)


def test_medians_of_what_is_finite(groups, lists):
    values = np.random.default_rng(2).normal(size=400)
    values[::3] = np.nan
    fewest = 64
    expected = []
    for members in lists:
        known = values[members][np.isfinite(values[members])] if members else np.zeros(0)
        expected.append(np.median(known) if len(known) >= fewest else np.nan)
    assert 5 < np.isnan(expected).sum() < 36  # some of both, or the limit would not be tried
    np.testing.assert_allclose(groups.median(values, fewest=fewest), expected)


def test_no_places():
    nothing = PointGroups.within(cKDTree(np.zeros((3, 2))), np.zeros((0, 2)), RADIUS)
    assert nothing.mean(np.zeros((3, 2))).shape == (0, 2) and nothing.median(np.zeros(3)).shape == (0,)
