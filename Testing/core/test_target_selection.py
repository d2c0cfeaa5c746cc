"""Selection of the target Gaussians and their cleaning."""

import numpy as np
import pytest

from organphys.ground.checks import InputError
from organphys.points.point_sets import Box, GaussianCloud
from organphys.points.target_selection import CleaningOptions, clean_points, select_clean_target, select_target


def cloud(opacities, valid=None) -> GaussianCloud:
    count = len(opacities)
    centres = np.stack([np.arange(count), np.zeros(count), np.zeros(count)], axis=1).astype(np.float32)
    valid = np.ones(count, bool) if valid is None else np.array(valid)
    return GaussianCloud(centres, np.array(opacities), np.zeros((count, 3)), valid)


def test_threshold_box_and_validity():
    splat = cloud([0.05, 0.1, 0.2, 0.9, 0.9, 0.9], [1, 1, 1, 1, 0, 1])
    assert select_target(splat).tolist() == [False, False, True, True, False, True]
    assert select_target(splat, opacity=0.5).nonzero()[0].tolist() == [3, 5]
    box = Box(np.array([2.5, 0, 0]), np.array([1.2, 1, 1]))
    assert select_target(splat, box=box).nonzero()[0].tolist() == [2, 3]


def test_masked_gaussian_with_nan_does_not_disturb():
    splat = cloud([0.9, 0.9], [1, 0])
    splat.centres[1] = np.nan
    assert select_target(splat, box=Box(np.zeros(3), np.ones(3))).tolist() == [True, False]


def test_nothing_left_is_an_input_error():
    with pytest.raises(InputError, match=r"no Gaussian above the opacity threshold 0.1 \(the highest is 0.05\)"):
        select_target(cloud([0.01, 0.05]))
    with pytest.raises(InputError, match="no Gaussian above"):
        select_target(cloud([0.9], [0]))
    with pytest.raises(InputError, match="holds no opaque Gaussian"):
        select_target(cloud([0.9]), box=Box(np.array([50.0, 0, 0]), np.ones(3)))
    with pytest.raises(InputError, match="expected 0 to 1"):
        select_target(cloud([0.9]), opacity=1.5)


def scene(seed=0):
    """Two true pieces of a surface, a clump of 5 points and 10 stray points."""
    rng = np.random.default_rng(seed)
    first = np.c_[rng.uniform(0, 1, (3000, 2)), rng.normal(0, 0.003, 3000)]
    second = first[:300] * [0.3, 0.3, 1] + [1.3, 0, 0]
    clump = rng.normal(0.5, 0.004, (5, 3))
    stray = rng.uniform(-1, 1, (10, 3)) * [1, 1, 0.2] + [0, 0, -1.5]
    return np.concatenate([first, second, clump, stray]), np.repeat([0, 1, 2, 3], [3000, 300, 5, 10])


def test_cleaning_keeps_pieces_and_reports_what_went():
    points, kind = scene()
    report = clean_points(points)
    assert report.keep[kind == 0].mean() > 0.97 and report.keep[kind == 1].mean() > 0.97
    assert not report.keep[kind >= 2].any()
    assert report.outliers + report.in_small_clusters == (~report.keep).sum()
    assert f"Removed {report.outliers} outliers" in report.notice.message
    shuffled = np.random.default_rng(1).permutation(len(points))
    assert np.array_equal(clean_points(points[shuffled]).keep, report.keep[shuffled])


def test_a_large_set_is_cleaned_as_its_subset_is():
    points, kind = scene()
    rng = np.random.default_rng(2)
    dense = np.c_[rng.uniform(0, 1, (30_000, 2)), rng.normal(0, 0.003, 30_000)]
    dense[:5000] = dense[:5000] * [0.3, 0.3, 1] + [1.3, 0, 0]
    everything = np.concatenate([dense, points[kind >= 2]])
    stray = np.arange(len(everything)) >= len(dense)
    whole, by_subset = clean_points(everything), clean_points(everything, options=CleaningOptions(most=4000))
    assert by_subset.keep[~stray].mean() > 0.97 and not by_subset.keep[stray].any()
    assert (by_subset.keep == whole.keep).mean() > 0.97
    assert by_subset.outliers + by_subset.in_small_clusters == (~by_subset.keep).sum()
    assert by_subset.spacing == pytest.approx(whole.spacing, rel=0.15)  # of the whole set, not of the subset


def test_cleaned_selection_indexes_the_whole_splat():
    points, kind = scene()
    count = len(points)
    opacities = np.where(np.arange(count) % 7 == 0, 0.01, 0.8)
    splat = GaussianCloud(points.astype(np.float32), opacities, np.zeros((count, 3)), np.ones(count, bool))
    selected, report = select_clean_target(splat)
    assert not selected[opacities < 0.1].any() and not selected[kind >= 2].any()
    assert selected.sum() == report.keep.sum() and len(report.keep) == (opacities > 0.1).sum()


def test_each_step_counts_for_itself():
    points, kind = scene()
    lenient = clean_points(points, options=CleaningOptions(rounds=0, neighbours=4))
    assert lenient.outliers == 0 and not lenient.keep[kind == 2].any()
    all_stay = clean_points(points, options=CleaningOptions(spread=1e9, smallest=0.0))
    assert all_stay.keep.all()


def test_few_points_are_left_alone():
    assert clean_points(np.random.default_rng(0).normal(size=(8, 3))).keep.all()
