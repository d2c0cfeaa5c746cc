"""The software renderer: pixels are where the geometry says, the nearest wins."""

import numpy as np
import pytest
from asset_examples import ellipsoid

from organphys.asset.surface_distance import vertex_normals
from organphys.exports.camera_view import View, parallel_view
from organphys.exports.mesh_thinning import thin_mesh
from organphys.exports.rasteriser import draw_dots, draw_triangles
from organphys.exports.renderer import BACKGROUND, SplatLayer, overlay_picture, splat_picture

DOWN = np.array([0.0, 1.0, 0.0])


def looking_along_z(width: int = 80, height: int = 60, focal: float = 100.0) -> View:
    return View(np.zeros(3), np.array([0.0, 0.0, 10.0]), DOWN, focal, width, height)


def test_projection_follows_the_opencv_axes() -> None:
    x, y, depth = looking_along_z().project(np.array([[1.0, 2.0, 10.0]]))[0]
    assert (x, y, depth) == pytest.approx((40 + 10, 30 + 20, 10))
    assert np.isnan(looking_along_z().project(np.array([[0.0, 0.0, -1.0]]))).all()


def test_turned_view_keeps_target_and_distance() -> None:
    view = looking_along_z()
    aside = view.turned(1, 90)
    assert aside.distance == pytest.approx(view.distance)
    assert np.allclose(aside.axes[1], DOWN) and abs(aside.axes[2] @ view.axes[2]) < 1e-12
    assert np.allclose(aside.project(view.target[None])[0, :2], [40, 30])


def test_fitted_view_holds_all_points() -> None:
    points = np.random.default_rng(0).normal(size=(500, 3)) + np.array([1.0, 2, 20])
    picture = looking_along_z().fitted(points).project(points)
    assert (picture[:, :2] > 0).all() and (picture[:, :2] < [80, 60]).all()
    assert max(np.ptp(picture[:, 0]) / 80, np.ptp(picture[:, 1]) / 60) > 0.7


def plane(depth: float, size: float, colour_at_corners: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    corners = size * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + [0, 0, depth]
    return corners, np.array([[0, 2, 1], [0, 3, 2]])  # facing the camera at the origin


def test_triangles_cover_exactly_the_square_and_the_nearest_wins() -> None:
    near, far = plane(10.0, 1.0), plane(20.0, 4.0)
    vertices = np.concatenate([far[0], near[0]])
    faces = np.concatenate([far[1], near[1] + 4])
    drawn = draw_triangles(looking_along_z(), vertices, faces)
    assert drawn.covered[10:50, 20:60].all() and drawn.covered.sum() == 40 * 40
    assert (drawn.index >= 2).sum() == 20 * 20 and np.allclose(drawn.depth[20:40, 30:50], 10)


def test_triangles_facing_away_are_not_drawn() -> None:
    vertices, faces = plane(10.0, 1.0)
    assert not draw_triangles(looking_along_z(), vertices, faces[:, ::-1]).covered.any()


def test_interpolation_is_linear_over_the_picture() -> None:
    vertices, faces = plane(10.0, 2.0)
    drawn = draw_triangles(looking_along_z(), vertices, faces)
    values = drawn.interpolated(faces, vertices[:, :2])
    y, x = np.nonzero(drawn.covered)
    assert np.allclose(values, np.stack([(x + 0.5 - 40) / 10, (y + 0.5 - 30) / 10], axis=1), atol=1e-4)


def test_sphere_has_its_area_and_depth() -> None:
    vertices, faces = ellipsoid(60, 120)
    vertices = (vertices - vertices.mean(0)) / [60, 35, 25] + [0, 0, 1000]
    drawn = draw_triangles(View(np.zeros(3), np.array([0.0, 0, 1000]), DOWN, 50_000.0, 160, 120), vertices, faces)
    assert drawn.covered.sum() == pytest.approx(np.pi * 50**2, rel=0.01)
    assert drawn.depth.min() == pytest.approx(999, abs=0.01)


def test_dots_grow_to_their_radius_and_hide_farther_ones() -> None:
    points = np.array([[0.0, 0, 10], [0.05, 0, 20]])
    drawn = draw_dots(looking_along_z(), points, 0.3)
    assert drawn.index[30, 40] == 0 and drawn.index[30, 42] == 0 and drawn.covered.sum() == 13
    assert not draw_dots(looking_along_z(), np.zeros((0, 3)), 1.0).covered.any()


def test_a_triangle_far_larger_than_the_picture_fills_it() -> None:
    vertices, faces = plane(10.0, 1e5)
    assert draw_triangles(looking_along_z(), vertices, faces).covered.all()


def test_points_off_the_picture_do_no_harm() -> None:
    rng = np.random.default_rng(0)
    wild = rng.normal(size=(300, 3)) * 1e3
    draw_dots(looking_along_z(), wild, 0.1)
    draw_triangles(looking_along_z(), wild, rng.integers(0, 300, (200, 3)))


def test_overlay_paints_the_organ_blue_over_the_splat_and_leaves_the_rest() -> None:
    vertices, faces = plane(10.0, 1.0)
    layer = SplatLayer(looking_along_z(), np.array([[0.0, 0, 11.0]]), np.array([[1.0, 0, 0]]), 0.2)
    alone, over = splat_picture(layer), overlay_picture(layer, vertices, faces, normals=np.tile([0, 0, -1.0], (4, 1)))
    assert alone.shape == over.shape == (60, 80, 3) and alone.dtype == np.uint8
    assert alone[30, 40, 0] > 200 and alone[30, 40, 2] < 30
    assert over[30, 40, 2] > 80 and over[30, 40, 0] > 60  # both show through
    assert np.array_equal(over[2, 2], np.round(255 * BACKGROUND).astype(np.uint8))


def test_parallel_view_and_thinned_mesh_keep_the_shape() -> None:
    vertices, faces = ellipsoid(120, 240)
    thin = thin_mesh(vertices, faces, cells_across=40)
    few = thin.averaged(vertices)
    assert len(few) < len(vertices) / 3
    view = parallel_view(vertices, np.array([0.0, 0, 1]), DOWN, 120, 90)
    areas = [draw_triangles(view, v, f).covered.sum() for v, f in ((vertices, faces), (few, thin.faces))]
    assert areas[1] == pytest.approx(areas[0], rel=0.05)
    outward = vertex_normals(few, thin.faces)
    assert (np.einsum("nd,nd->n", outward, few - few.mean(0)) > 0).mean() > 0.99
