"""The reference image and the true rim, on discs whose outline is known."""

from dataclasses import replace

import numpy as np
import pytest

from organphys.align.camera_image import BEYOND_CUT, UNSEEN, camera_image
from organphys.align.rim import find_rim
from organphys.align.splat_surface import SplatSurface

DEPTH, RADIUS = 4.0, 1.0
NOTHING = np.zeros((0, 3))


def surface_of(points, centre=(0.0, 0.0)):
    """With the normals of a dome over the unit disc about ``centre``: across the ray at the disc's outline."""
    aside = (points[:, :2] - np.array(centre)) / RADIUS
    normals = np.column_stack([aside, -np.sqrt(np.clip(1 - (aside**2).sum(1), 0, None))])
    radius = float(np.sqrt(((points - points.mean(0)) ** 2).sum(1).mean()))
    return SplatSurface(points, normals, points[::5], normals[::5], 0.01, radius)


def disc(*, radius=RADIUS, centre=(0.0, 0.0), depth=DEPTH, step=0.01):
    """Fine grid of points (N, 3) on a disc across the view."""
    axis = np.arange(-radius, radius + step, step)
    x, y = (a.ravel() for a in np.meshgrid(axis, axis, indexing="ij"))
    inside = x * x + y * y < radius**2
    return np.column_stack([x[inside] + centre[0], y[inside] + centre[1], np.full(inside.sum(), depth)])


def pixel_grid(image):
    """Image-plane coordinates (W, H, 2) of all pixel centres."""
    return image.centre(np.moveaxis(np.indices(image.mask.shape), 0, -1))


def at(image, x, y):
    """Pixel index of a point at the disc's depth."""
    i, j = image.index(np.array([x, y]) / DEPTH)
    return int(i), int(j)


@pytest.fixture(scope="module")
def image():
    return camera_image(surface_of(disc()), NOTHING, fov_deg=100.0)


def test_mask_is_the_disc(image):
    distance = np.linalg.norm(pixel_grid(image), axis=2)
    edge = RADIUS / DEPTH
    assert image.mask[distance < edge - image.pixel].all()
    assert not image.mask[distance > edge + image.pixel].any()
    assert image.mask.sum() * image.pixel**2 == pytest.approx(np.pi * edge**2, rel=0.03)
    assert 2 * edge / image.pixel == pytest.approx(110, rel=0.02)


def test_index_and_centre_are_inverse(image):
    index = np.array([[0, 0], [5, 7], [30, 11]])
    np.testing.assert_array_equal(image.index(image.centre(index)), index)


def test_around_a_lone_disc_all_is_known_to_be_empty(image):
    assert not image.unknown.any()


def test_gap_and_nearest_measure_the_way_to_the_mask(image):
    i, j = at(image, 1.4, 0.0)
    assert image.gap[i, j] == pytest.approx(0.4 / DEPTH, abs=1.5 * image.pixel)
    assert image.mask[tuple(image.nearest[:, i, j])]
    assert image.gap[image.mask].max() == 0


def test_front_is_the_nearest_point_of_the_pixel():
    points = np.vstack([disc(), disc(radius=0.4, depth=3.0)])
    image = camera_image(surface_of(points), NOTHING, fov_deg=100.0)
    assert points[image.front[at(image, 0.0, 0.0)], 2] == 3.0
    assert points[image.front[at(image, 0.8, 0.0)], 2] == DEPTH


def test_hole_and_strip_are_unknown():
    points = disc()
    hole = np.hypot(points[:, 0] + 0.4, points[:, 1]) < 0.15
    strip = np.abs(points[:, 0] - 0.4) < 0.08
    image = camera_image(surface_of(points[~hole & ~strip]), NOTHING, fov_deg=100.0)
    for x, y in ((-0.4, 0.0), (0.4, 0.0), (0.4, 0.7)):
        assert image.unknown[at(image, x, y)] and not image.mask[at(image, x, y)]
    for x, y in ((0.0, 1.3), (-1.3, 0.5), (1.2, -1.2)):
        assert not image.unknown[at(image, x, y)] and not image.mask[at(image, x, y)]


def test_outside_the_field_of_view_is_unknown():
    """A given field of view rules; else the cone that holds all points."""
    half = np.degrees(np.arctan(1.15 / DEPTH))
    image = camera_image(surface_of(disc()), NOTHING, fov_deg=2 * half)
    assert image.unknown[at(image, 1.3, 0.0)] and not image.unknown[at(image, 1.05, 0.0)]
    background = np.repeat([[4.0, 0, DEPTH + 3.0], [-4.0, 0, DEPTH + 3.0]], 100, axis=0)
    image = camera_image(surface_of(disc()), background)
    assert not image.unknown[at(image, 1.2, 0.0)]
    assert camera_image(surface_of(disc()), NOTHING).unknown[at(image, 1.2, 0.0)]


def test_background_behind_is_empty_and_an_occluder_before_is_unknown():
    far = disc(centre=(0.0, 3.0), radius=1.0, depth=10.0)  # projects to y = 1.2 at the disc's depth
    near = disc(centre=(-0.65, 0.0), radius=0.2, depth=2.0)  # to x = -1.3
    image = camera_image(surface_of(disc()), np.vstack([far, near]), fov_deg=100.0)
    assert not image.unknown[at(image, 0.0, 1.2)]
    assert image.unknown[at(image, -1.3, 0.0)]
    # a neighbour hardly behind the organ touches it: nobody knows what it hides
    touching = disc(centre=(1.3, 0.0), radius=0.2, depth=DEPTH - 0.05)  # 0.04 farther away than the rim
    assert camera_image(surface_of(disc()), touching, fov_deg=100.0).unknown[at(image, 1.3, 0.0)]


def test_points_behind_the_camera_do_no_harm(image):
    behind = camera_image(surface_of(disc()), disc(depth=-3.0), fov_deg=100.0)
    np.testing.assert_array_equal(behind.unknown, image.unknown)


def test_specks_do_not_become_organ():
    speck = disc(radius=0.03, centre=(1.4, 0.0))
    image = camera_image(surface_of(np.vstack([disc(), speck])), NOTHING, fov_deg=100.0)
    assert not image.mask[at(image, 1.4, 0.0)]


@pytest.fixture(scope="module")
def random_disc():
    rng = np.random.default_rng(0)
    angle, r = rng.uniform(0, 2 * np.pi, 40000), RADIUS * np.sqrt(rng.uniform(size=40000))
    return surface_of(np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(40000, DEPTH)]))


def test_rim_lies_on_the_outline_to_a_fraction_of_a_pixel(random_disc):
    image = camera_image(random_disc, NOTHING, fov_deg=100.0)
    rim = find_rim(random_disc, image, shift_pixels=0.0)
    radius = np.linalg.norm(rim.points, axis=1)
    error = (radius - RADIUS / DEPTH) / image.pixel
    assert len(rim.points) > 200
    assert abs(error.mean()) < 0.25 and np.abs(error).max() < 1.0
    radial = rim.points / radius[:, None]
    assert (rim.normals * radial).sum(1).min() > np.cos(np.radians(10))
    shifted = find_rim(random_disc, image, shift_pixels=0.35)
    moved = ((shifted.points - rim.points) * rim.normals).sum(1)
    np.testing.assert_allclose(moved, 0.35 * image.pixel, rtol=1e-6)


def test_no_rim_beside_the_unknown():
    """Where a strip or the edge of the view cuts the organ, its outline is not its own."""
    points = disc()
    strip = np.abs(points[:, 0] - 0.4) < 0.08
    surface = surface_of(points[~strip])
    image = camera_image(surface, NOTHING, fov_deg=100.0)
    rim = find_rim(surface, image, shift_pixels=0.0).points * DEPTH
    assert len(rim) > 100
    assert np.linalg.norm(rim, axis=1).min() > 0.95  # nothing along the strip
    points = disc(centre=(-0.7, 0.0))
    cut = surface_of(points[np.linalg.norm(points[:, :2], axis=1) < 1.2], centre=(-0.7, 0.0))
    image = camera_image(cut, NOTHING, fov_deg=2 * np.degrees(np.arctan(1.2 / DEPTH)))
    rim = find_rim(cut, image, shift_pixels=0.0).points * DEPTH
    assert np.linalg.norm(rim, axis=1).max() < 1.2 - 3 * image.pixel * DEPTH
    assert rim[:, 0].max() == pytest.approx(0.3, abs=0.03)


def test_no_rim_at_all_when_the_view_is_full():
    surface = surface_of(disc())
    assert find_rim(surface, camera_image(surface, NOTHING, fov_deg=5.0)).points.shape == (0, 2)


def dome_cut_at(x):
    points = disc()
    surface = surface_of(points)
    kept = points[:, 0] < x
    return replace(surface, points=points[kept], normals=surface.normals[kept])


def test_beyond_a_cut_nothing_is_known():
    """The part of the outline at which the surface still faced the camera is no outline: the organ may go on there."""
    image = camera_image(dome_cut_at(0.1), NOTHING, fov_deg=100.0)
    for x, y in ((0.3, 0.0), (0.9, 0.0), (0.3, 0.8), (0.5, 1.1)):
        assert image.unknown[at(image, x, y)]
        assert image.unseen_cost[at(image, x, y)] == np.float32(BEYOND_CUT)
    for x, y in ((-1.2, 0.0), (-0.9, 0.9), (-0.3, -1.1)):
        assert not image.unknown[at(image, x, y)]
    assert image.unseen_cost[at(image, -1.2, 0.0)] == np.float32(UNSEEN)


def test_a_cut_is_no_rim():
    surface = dome_cut_at(0.1)
    image = camera_image(surface, NOTHING, fov_deg=100.0)
    rim = find_rim(surface, image, shift_pixels=0.0).points * DEPTH
    assert len(rim) > 60
    assert not ((np.abs(rim[:, 0] - 0.1) < 0.08) & (np.abs(rim[:, 1]) < 0.8)).any()


def test_unseen_cost_at_points_outside_the_image_is_that_of_its_border():
    image = camera_image(dome_cut_at(0.1), NOTHING, fov_deg=100.0)
    far = np.array([[50.0, 0.0, DEPTH], [-50.0, 0.0, DEPTH]])
    middle = image.mask.shape[1] // 2
    border = image.unseen_cost[[-1, 0], [middle, middle]]
    np.testing.assert_array_equal(image.unseen_cost_at(far), border)
    assert border[0] == np.float32(BEYOND_CUT)


def test_rim_normals_point_outward_up_to_a_cut():
    surface = dome_cut_at(-0.4)  # the outline meets the cut at an acute angle
    rim = find_rim(surface, camera_image(surface, NOTHING, fov_deg=100.0))
    radial = rim.points / np.linalg.norm(rim.points, axis=1, keepdims=True)
    cosine = np.einsum("ij,ij->i", rim.normals, radial)
    assert len(rim.points) > 60
    off = np.degrees(np.arccos(cosine.clip(-1, 1)))
    assert off.max() < 45 and np.quantile(off, 0.9) < 10  # 118 degrees where the cut is smoothed in


def test_a_cut_just_before_the_surface_turns_away_is_no_rim():
    """Its cosine falls fast towards the cut, as at an outline, but not towards 0."""
    surface = dome_cut_at(0.1)
    pixel = camera_image(surface, NOTHING, fov_deg=100.0).pixel * DEPTH
    square = np.clip(0.32 + 0.08 * (0.1 - surface.points[:, :1]) / pixel, 0.0, 1.0)
    ray = surface.points / np.linalg.norm(surface.points, axis=1, keepdims=True)
    aside = np.array([1.0, 0.0, 0.0]) - ray[:, :1] * ray
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    near = square < 1  # further in, the dome goes on to its own outline
    surface = replace(
        surface, normals=np.where(near, np.sqrt(1 - square) * aside - np.sqrt(square) * ray, surface.normals)
    )
    image = camera_image(surface, NOTHING, fov_deg=100.0)
    rim = find_rim(surface, image, shift_pixels=0.0).points * DEPTH
    assert len(rim) > 60
    assert not (rim[:, 0] > 0.1 - 3 * pixel).any()
