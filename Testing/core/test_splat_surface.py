"""The splat made into a clean oriented surface: on a sphere cap with known normals."""

import numpy as np
import pytest

from organphys.align.quick_surface import quick_surface
from organphys.align.splat_surface import (
    SplatSurfaceOptions,
    cell_averages,
    plane_normals,
    splat_surface,
    towards_camera,
)
from organphys.align.splat_view import look, splat_view
from organphys.ground.checks import InputError
from organphys.points.point_sets import Camera

CENTRE, RADIUS = np.array([0.2, -0.1, 5.0]), 1.0
NOISE = 0.01


def cap(count=9000, noise=NOISE, seed=0, reach=0.9):
    """Points (N, 3) of the side of a sphere that faces the origin, out to sin(angle) = ``reach``."""
    rng = np.random.default_rng(seed)
    axis = -CENTRE / np.linalg.norm(CENTRE)
    directions = rng.normal(size=(20 * count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = directions[directions @ axis > np.sqrt(1 - reach**2)][:count]
    return CENTRE + directions * (RADIUS + noise * rng.normal(size=(len(directions), 1)))


def radial(points):
    offset = points - CENTRE
    return offset / np.linalg.norm(offset, axis=1, keepdims=True)


def off_sphere(points):
    return np.abs(np.linalg.norm(points - CENTRE, axis=1) - RADIUS)


@pytest.fixture(scope="module", params=[splat_surface, quick_surface])
def surface(request):
    return request.param(cap())


def test_normals_point_outwards_to_the_camera(surface):
    angle = np.degrees(np.arccos(np.clip((surface.normals * radial(surface.points)).sum(1), -1, 1)))
    assert np.median(angle) < 8 and np.percentile(angle, 95) < 20
    averaged = (surface.sample_normals * radial(surface.samples)).sum(1)
    assert np.median(np.degrees(np.arccos(np.clip(averaged, -1, 1)))) < 5
    np.testing.assert_allclose(np.linalg.norm(surface.sample_normals, axis=1), 1)


def test_plane_normals_of_a_plane_are_exact():
    rng = np.random.default_rng(0)
    normal = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    points = rng.normal(size=(300, 3))
    points -= np.outer(points @ normal, normal) - [0, 0, 6]
    found = towards_camera(points, plane_normals(points, 12))
    np.testing.assert_allclose(found, np.tile(-np.sign(normal[2]) * normal, (300, 1)), atol=1e-6)


def test_averaging_reduces_noise_and_hits_the_count(surface):
    assert 1800 < len(surface.samples) < 2800
    assert off_sphere(surface.samples).mean() < 0.75 * off_sphere(surface.points).mean()
    assert surface.radius == pytest.approx(np.sqrt(((surface.points - surface.points.mean(0)) ** 2).sum(1).mean()))
    np.testing.assert_array_equal(surface.centre, np.median(surface.points, axis=0))


def test_cell_average_is_the_mean_of_its_points():
    points = np.array([[0, 0, 0], [0.2, 0, 0], [10, 0, 0], [10, 0.4, 0], [20, 20, 20.0]])
    normals = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [1, 0, 0], [0, 0, 1.0]])
    means, mean_normals = cell_averages(points, normals, 3)
    np.testing.assert_allclose(means, [[0.1, 0, 0], [10, 0.2, 0]])  # the lone point is left out
    np.testing.assert_allclose(mean_normals, [[0, np.sqrt(0.5), np.sqrt(0.5)], [1, 0, 0]])


@pytest.mark.parametrize("surface_of", [splat_surface, quick_surface])
def test_outliers_and_a_clump_are_removed(surface_of):
    rng = np.random.default_rng(1)
    clump = CENTRE + [0.0, 0, -2.0] + 0.03 * rng.normal(size=(60, 3))
    floaters = CENTRE + rng.uniform(-2.5, 2.5, (300, 3))
    floaters = floaters[off_sphere(floaters) > 0.3]
    surface = surface_of(np.vstack([cap(), clump, floaters]))
    assert off_sphere(surface.points).max() < 0.2
    assert len(surface.points) > 0.97 * 9000


@pytest.mark.parametrize("surface_of", [splat_surface, quick_surface])
def test_both_sides_of_a_tool_strip_are_kept(surface_of):
    points = cap()
    strip = np.abs(points[:, 0] - CENTRE[0] - 0.3) < 0.1
    surface = surface_of(points[~strip])
    right, left = surface.points[:, 0] > CENTRE[0] + 0.3, surface.points[:, 0] < CENTRE[0] + 0.3
    whole = points[~strip]
    assert right.sum() > 0.97 * (whole[:, 0] > CENTRE[0] + 0.3).sum()
    assert left.sum() > 0.97 * (whole[:, 0] < CENTRE[0] + 0.3).sum()


def test_large_splats_are_subsampled_with_the_seed():
    points = cap(count=9000)
    options = SplatSurfaceOptions(centres=4000)
    first, again = (splat_surface(points, options=options, seed=2) for _ in range(2))
    np.testing.assert_array_equal(first.samples, again.samples)
    assert len(first.points) <= 4000
    assert not np.array_equal(first.points, splat_surface(points, options=options, seed=3).points)


@pytest.mark.parametrize("surface_of", [splat_surface, quick_surface])
def test_too_few_points_are_refused(surface_of):
    with pytest.raises(InputError, match="lower the opacity"):
        surface_of(cap(count=80))


def test_both_surfaces_measure_nearly_the_same_spacing():
    assert quick_surface(cap()).spacing == pytest.approx(splat_surface(cap()).spacing, rel=0.1)


def test_camera_frame_of_a_moved_camera():
    """Same view direction, other position: only a shift."""
    points, position = cap(count=3000), np.array([3.0, -1.0, 2.0])
    view = splat_view(points + position, np.zeros((0, 3)), Camera(position=position))
    np.testing.assert_array_equal(view.T_camera_scene.rotation, np.eye(3))
    np.testing.assert_allclose(view.T_camera_scene.apply(position), 0, atol=1e-12)
    assert view.notices == ()
    np.testing.assert_allclose(view.surface.centre, splat_surface(points).centre, atol=0.02)


def test_splat_behind_the_camera_turns_it_and_says_so():
    points = cap(count=3000) * [1, 1, -1]
    T_camera_scene, notices = look(points, Camera())
    assert [notice.code for notice in notices] == ["camera_turned"]
    turned = T_camera_scene.apply(points)
    assert np.median(turned[:, 2]) > 3
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(points, axis=1))


def test_camera_in_the_middle_is_refused():
    points = cap(count=3000)
    symmetric = np.vstack([points, -points])
    with pytest.raises(InputError, match="camera"):
        look(np.vstack([symmetric, np.zeros((1, 3))]) + 4.0, Camera(position=np.full(3, 4.0)))


def test_a_sparse_splat_has_samples_too():
    random = np.random.default_rng(0)
    sheet = np.column_stack([random.uniform(-1, 1, (600, 2)), np.full(600, 5.0)])
    surface = splat_surface(sheet)
    assert len(surface.samples) > 100
    np.testing.assert_allclose(surface.samples[:, 2], 5.0)
