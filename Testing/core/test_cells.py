"""Cubic cells of points: their number, means, crowds and pieces."""

import numpy as np
import pytest

from organphys.ground.frames import rotation_about
from organphys.points.cells import Cells
from organphys.points.sampling import cell_keys, cells_of_keys


def sheet(count=20_000, seed=0):
    """Points (N, 3) on a slightly rough disc of radius 0.6, tilted."""
    rng = np.random.default_rng(seed)
    radius, angle = 0.6 * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    flat = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0.002 * rng.normal(size=count)])
    return flat @ rotation_about(np.array([1.0, 0.5, 0.2]), 0.6).T


def test_keys_give_their_cells_back():
    points = np.random.default_rng(0).uniform(-5, 9, (500, 3))
    np.testing.assert_array_equal(cells_of_keys(cell_keys(points, 0.7)), ((points - points.min(0)) / 0.7).astype(int))


@pytest.mark.parametrize("strays", [0, 5000])
@pytest.mark.parametrize("count", [300, 1800])
def test_so_many_cells_are_well_filled_whatever_lies_around(count, strays):
    around = np.random.default_rng(1).uniform(-3, 3, (strays, 3))
    cells = Cells.of(np.vstack([sheet(), around]), count)
    assert (cells.number >= cells.least).sum() == pytest.approx(count, rel=0.1)


def test_mean_of_a_cell_is_that_of_its_points():
    points = sheet(3000)
    cells = Cells.of(points, 100)
    cell = int(cells.number.argmax())
    inside = cells.of_point == cell
    assert inside.sum() == cells.number[cell]
    np.testing.assert_allclose(cells.mean(points)[cell], points[inside].mean(0))


def test_crowd_counts_the_cells_that_touch():
    points = sheet(2000)
    cells = Cells.of(points, 60)
    apart = np.abs(cells.index[:, None] - cells.index[None]).max(2)
    np.testing.assert_array_equal(cells.crowd, (apart <= 1) @ cells.number)


def test_surface_keeps_large_pieces_and_no_strays():
    rng = np.random.default_rng(2)
    piece = sheet(10_000) + np.array([3.0, 0, 1])
    clump = np.array([0.0, 0, 4]) + 0.03 * rng.normal(size=(100, 3))
    strays = rng.uniform(-3, 5, (1500, 3))
    cells = Cells.of(np.vstack([sheet(), piece, clump, strays]), 1800)
    stays = cells.surface(sparse=0.16, smallest=0.01)[cells.of_point]
    assert stays[:30_000].mean() > 0.999
    assert not stays[30_000:30_100].any()
    assert stays[30_100:].mean() < 0.05  # what lies by chance on the surface


def test_points_in_one_place_make_one_cell():
    cells = Cells.of(np.ones((50, 3)), 10)
    assert len(cells.number) == 1 and cells.surface(sparse=0.16, smallest=0.01).all()
