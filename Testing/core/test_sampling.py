"""Subsampling of points, samples of the organ surface and the lookup of the nearest one."""

from dataclasses import replace

import numpy as np
import pytest
from scene_examples import CENTRE_MM, bumpy_organ, level
from scipy.spatial import cKDTree

from organphys.ground.checks import InputError
from organphys.points.sampling import cell_keys, farthest_points, one_per_cell, random_subset
from organphys.points.surface_samples import ClosestSampleGrid, sample_surface


@pytest.fixture(scope="module")
def organ():
    return bumpy_organ()


@pytest.fixture(scope="module")
def samples(organ):
    return sample_surface(organ, count=3000)


def test_random_subset_is_sorted_unique_and_seeded():
    chosen = random_subset(1000, 100, 3)
    assert len(np.unique(chosen)) == 100 and (np.diff(chosen) > 0).all() and chosen.max() < 1000
    np.testing.assert_array_equal(chosen, random_subset(1000, 100, 3))
    assert (random_subset(1000, 100, 4) != chosen).any()
    np.testing.assert_array_equal(random_subset(5, 10, 0), np.arange(5))


def test_farthest_points_on_a_line():
    """From the far end to the other end, then always the middle of the widest gap."""
    line = np.array([0, 1, 2, 3, 4, 5, 6, 7, 8.5])[:, None] * [1.0, 0, 0]
    np.testing.assert_array_equal(farthest_points(line, 3), [8, 0, 4])
    assert sorted(farthest_points(line, 20)) == list(range(9))


def test_farthest_points_cover_better_than_chance():
    points = np.random.default_rng(0).uniform(size=(4000, 3))

    def hole(index):
        return cKDTree(points[index]).query(points)[0].max()

    assert hole(farthest_points(points, 60)) < 0.75 * hole(random_subset(4000, 60, 0))


def test_cell_keys_name_exactly_the_cells():
    rng = np.random.default_rng(0)
    points = rng.uniform(-50, 800, size=(20000, 3))
    cell = 17.0
    index = np.floor((points - points.min(0)) / cell).astype(int)
    keys = cell_keys(points, cell)
    assert len(np.unique(keys)) == len(np.unique(index, axis=0))
    _, by_key = np.unique(keys, return_inverse=True)
    pairs = np.unique(np.column_stack([by_key, index]), axis=0)
    assert len(pairs) == len(np.unique(keys))  # one cell per key


def test_cell_keys_of_a_huge_extent_do_not_collide():
    top, half = (1 << 21) - 1, 1 << 20
    points = (
        np.array(
            [[0, 0, half], [0, half, 0], [0, 0, 0], [0, 0, top], [0, 1, 0], [1, 0, 0], [0, top, 0], [top, top, top]]
        )
        + 0.5
    )
    assert len(np.unique(cell_keys(points, 1.0))) == len(points)
    with pytest.raises(ValueError, match="too small"):
        cell_keys(np.array([[0, 0, 0], [0, 0, top + 2.0]]), 1.0)


def test_one_per_cell_keeps_the_first_of_each():
    points = np.array([[0.1, 0, 0], [0.2, 0, 0], [5.3, 0, 0], [5.4, 0, 0], [0.3, 0, 0]])
    np.testing.assert_array_equal(one_per_cell(points, 1.0), [0, 2])


def test_samples_lie_on_the_surface_with_outward_normals(organ, samples):
    points = samples.normalisation.undo(samples.points)
    # chords of the mesh cut corners by far less than 2 %
    np.testing.assert_allclose(level(points), 1.0, atol=0.02)
    step = 1e-3 * np.eye(3)
    slope = np.stack([level(points + h) - level(points - h) for h in step], axis=1)
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    np.testing.assert_allclose(np.linalg.norm(samples.normals, axis=1), 1)
    angle = np.degrees(np.arccos(np.clip((slope * samples.normals).sum(1), -1, 1)))
    assert np.median(angle) < 2 and np.percentile(angle, 99) < 8


def test_samples_are_unit_free_and_even(samples):
    np.testing.assert_allclose(samples.points.mean(0), 0, atol=1e-12)
    assert np.sqrt((samples.points**2).sum(1).mean()) == pytest.approx(1)
    assert 1500 < len(samples.points) <= 3000
    nearest = cKDTree(samples.points).query(samples.points, k=2)[0][:, 1]
    assert nearest.mean() == pytest.approx(0.7 * samples.spacing, rel=0.2)
    # no holes: every place has a sample within two spacings
    dense = sample_surface(bumpy_organ(), count=20000, seed=1)
    x = samples.normalisation.apply(dense.normalisation.undo(dense.points))
    assert cKDTree(samples.points).query(x)[0].max() < 2 * samples.spacing


def test_samples_follow_area_not_triangles(organ, samples):
    """The mesh is far finer at its poles; the samples must not be."""
    corners = organ.vertices[organ.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    middle = corners.mean(1)

    def near_pole(points):
        away = points - CENTRE_MM
        return away[:, 2] > 0.8 * np.linalg.norm(away, axis=1)

    share = area[near_pole(middle)].sum() / area.sum()
    points = samples.normalisation.undo(samples.points)
    assert near_pole(points).mean() == pytest.approx(share, rel=0.1)
    assert near_pole(organ.vertices).mean() > 1.2 * share  # the test can tell


def test_samples_are_seeded(organ, samples):
    np.testing.assert_array_equal(sample_surface(organ, count=3000).points, samples.points)


def test_surface_without_area_is_refused(organ):
    flat = replace(organ, vertices=np.zeros_like(organ.vertices))
    with pytest.raises(InputError, match="no area"):
        sample_surface(flat)


def test_grid_finds_the_nearest_sample_to_within_a_cell(samples):
    grid = ClosestSampleGrid(samples.points)
    x = np.random.default_rng(0).uniform(-1.8, 1.8, size=(5, 400, 3))
    found = grid.lookup(*np.moveaxis(x, -1, 0).astype(np.float32))
    assert found.shape == (5, 400)
    inside = ((x > grid.low) & (x < -grid.low)).all(-1)
    distance = np.linalg.norm(x - samples.points[found], axis=-1)
    exact = cKDTree(samples.points).query(x)[0]
    assert (distance - exact)[inside].max() < 2 * grid.cell  # half a cell's diagonal there and back, and eps
    assert inside.mean() > 0.5


def test_grid_far_outside_answers_from_its_border(samples):
    grid = ClosestSampleGrid(samples.points)
    for far in (-1e4, 1e4):
        x = np.array([far], dtype=np.float32)
        y = np.zeros(1, dtype=np.float32)
        row = grid.lookup(x, y, y)[0]
        assert samples.points[row, 0] * np.sign(far) > 0.6


def test_mirrored_grid_finds_the_mirror_image_of_what_the_grid_finds(samples):
    grid = ClosestSampleGrid(samples.points)
    x = np.random.default_rng(3).uniform(-2.5, 2.5, (2000, 3)).astype(np.float32)
    mirrored = grid.mirrored().lookup(-x[:, 0], x[:, 1], x[:, 2])
    assert np.mean(mirrored == grid.lookup(*x.T)) > 0.999  # but for ties on the edges of cells
