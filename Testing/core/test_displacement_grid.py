"""Displacement grids: the organ's own map within the error they tell, forth and back, and nothing at the border."""

import numpy as np
import pytest
from asset_examples import bent_organ
from scipy import ndimage

from organphys.asset.grid_spline import GridSpline
from organphys.exports.displacement_grid import sample_displacement
from organphys.exports.grid_axes import GridAxes, cubic, doubled, trilinear
from organphys.ground.checks import InputError


@pytest.fixture(scope="module")
def organ():
    return bent_organ()


@pytest.fixture(scope="module")
def grids(organ):
    told = []
    made = sample_displacement(organ, progress=lambda stage, part: told.append((stage, part)))
    assert [stage for stage, _ in told] == ["grids"] * len(told) and told[-1][1] == 1.0
    assert [part for _, part in told] == sorted(part for _, part in told)
    return made


def at(grid, points, order=3):
    """Vectors (N, 3) at points (N, 3), by an interpolation that is not the grid's own: linear, or cubic B-splines."""
    index = ((points - grid.origin) / grid.spacing)[:, ::-1].T
    return np.stack(
        [ndimage.map_coordinates(grid.vectors[..., a].astype(float), index, order=order) for a in range(3)], axis=1
    )


def inside(organ):
    rng = np.random.default_rng(5)
    volume = organ.volume_points[rng.integers(0, len(organ.volume_points), 2000)]
    return volume + rng.uniform(-0.5, 0.5, volume.shape)


def test_forward_grid_is_the_map_inside_the_organ(organ, grids):
    points = inside(organ)
    mapped = organ.T_scene_ct.apply(points + at(grids.forward, points))
    error = np.linalg.norm(mapped - organ.map_points(points), axis=1) * organ.mm_per_unit
    assert error.max() < 0.05 and grids.forward.error_mm["max"] < 0.05
    assert np.percentile(error, 95) == pytest.approx(grids.forward.error_mm["p95"], rel=0.5)
    linear = np.linalg.norm(at(grids.forward, points, order=1) - at(grids.forward, points), axis=1)
    assert np.percentile(linear, 95) == pytest.approx(grids.forward.linear_error_mm["p95"], rel=0.5)
    still = np.linalg.norm(organ.T_scene_ct.apply(points) - organ.map_points(points), axis=1) * organ.mm_per_unit
    assert still.max() > 5  # there is something to interpolate


def test_inverse_grid_leads_back(organ, grids):
    points = inside(organ)
    pulled = organ.T_scene_ct.inverse().apply(organ.map_points(points))
    error = np.linalg.norm(pulled + at(grids.inverse, pulled) - points, axis=1)
    assert error.max() < 0.1 and np.percentile(error, 95) < 2 * grids.inverse.error_mm["p95"] + 0.01


def test_grids_hold_beside_the_organ_and_end_in_nothing(organ, grids):
    rng = np.random.default_rng(1)
    normals = organ.surface_distance.normals
    beside = organ.vertices + normals * rng.uniform(0, 30, (len(normals), 1))
    expected = organ.T_scene_ct.inverse().apply(organ.map_points(beside)) - beside
    for grid, at_points, vectors in ((grids.forward, beside, expected), (grids.inverse, beside + expected, -expected)):
        error = np.linalg.norm(at(grid, at_points) - vectors, axis=1)
        assert np.percentile(error, 95) < 2 * grid.error_outside_mm["p95"] + 0.01
        assert grid.error_outside_mm["p95"] < 0.2
        low, high = grid.origin, grid.origin + grid.spacing * (np.array(grid.vectors.shape[2::-1]) - 1)
        assert (low <= organ.vertices.min(0) - 35).all() and (high >= organ.vertices.max(0) + 35).all()
        for axis in range(3):
            assert not np.take(grid.vectors, [0, -1], axis=axis).any()
        assert grid.vectors.dtype == np.float32 and grid.vectors.flags["C_CONTIGUOUS"]


def test_tolerance_sets_the_spacing(organ, grids):
    coarse = sample_displacement(organ, tolerance_mm=0.5)
    assert coarse.forward.spacing[0] > 1.5 * grids.forward.spacing[0]
    assert coarse.forward.error_mm["max"] < 0.5
    with pytest.raises(InputError, match="tolerance"):
        sample_displacement(organ, tolerance_mm=0.0)


def test_spline_on_a_grid_is_the_spline_at_its_nodes():
    rng = np.random.default_rng(2)
    spline = GridSpline(np.array([1.0, -2, 3]), 0.7, rng.normal(size=(7, 9, 8, 4)))
    axes = [rng.uniform(-3, 12, n) for n in (5, 6, 4)]  # also beyond the border
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    np.testing.assert_allclose(spline.on_axes(*axes).reshape(-1, 4), spline.values(points), atol=1e-12)


def test_doubling_keeps_cubics_and_trilinear_keeps_planes():
    axes = GridAxes.round(np.array([[0.0, 0, 0], [5, 7, 9]]), 2.0, 1.0, most=10**6)
    assert all(n % 2 == 1 for n in axes.counts)

    def cubic(points):
        x, y, z = points.T
        return np.stack([x**3 - x * y, z**2 * y, x * y * z], axis=1)

    every = np.ones(axes.every_second.counts, dtype=bool)
    fine = doubled(cubic(axes.every_second.nodes(every)).reshape(*every.shape, 3))
    expected = cubic(axes.nodes(np.ones(axes.counts, dtype=bool))).reshape(*axes.counts, 3)
    np.testing.assert_allclose(fine[3:-3, 3:-3, 3:-3], expected[3:-3, 3:-3, 3:-3], atol=1e-9)
    points = np.random.default_rng(0).uniform(0, 5, (50, 3))
    nodes = axes.nodes(np.ones(axes.counts, dtype=bool)).reshape(*axes.counts, 3)
    np.testing.assert_allclose(trilinear(nodes.transpose(2, 1, 0, 3), axes, points), points, atol=1e-12)


def test_cubic_interpolation_has_four_points_per_axis():
    axes = GridAxes.round(np.array([[0.0, 0, 0], [5, 7, 9]]), 4.0, 1.0, most=10**6)
    x, y, z = np.meshgrid(*axes.all, indexing="ij")
    field = np.stack([x**2 - y, y * z, 0.1 * z**2], -1)  # Catmull-Rom keeps parabolas
    points = np.random.default_rng(0).uniform(0, 5, (60, 3))
    a, b, c = points.T
    expected = np.stack([a**2 - b, b * c, 0.1 * c**2], axis=1)
    np.testing.assert_allclose(cubic(field.transpose(2, 1, 0, 3), axes, points), expected, atol=1e-9)
    one = np.zeros((*axes.counts[::-1], 3))
    one[4, 4, 4] = 1.0
    half = axes.origin + 3.5 * axes.spacing
    assert cubic(one, axes, half[None])[0, 0] == pytest.approx((9 / 16) ** 3)


def test_a_grid_is_never_larger_than_allowed():
    axes = GridAxes.round(np.array([[0.0, 0, 0], [200, 200, 200]]), 40.0, 0.8, most=100_000)
    assert np.prod(axes.counts) <= 100_000 and axes.spacing > 0.8 and axes.is_full(100_000)
