"""The map CT -> scene inside and beside the organ, its gradient and its inverse."""

import numpy as np
import pytest
from asset_examples import AXES_MM, CENTRE_MM, bent_organ, ellipsoid, inside_points

from organphys.asset.fill_outwards import fill_outwards
from organphys.asset.grid_distance import grid_distance
from organphys.asset.grid_spline import GridSpline
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.asset.surface_distance import SurfaceDistance
from organphys.ground.checks import InputError


@pytest.fixture(scope="module")
def organ() -> RegisteredOrgan:
    return bent_organ()


def round_about(count: int, low: float, high: float, seed: int = 1) -> np.ndarray:
    """Points outside the ellipsoid, low to high mm along the normal from its surface."""
    rng = np.random.default_rng(seed)
    sphere = rng.normal(size=(count, 3))
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    normal = sphere / AXES_MM
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return CENTRE_MM + sphere * AXES_MM + normal * rng.uniform(low, high, (count, 1))


def test_inside_is_exactly_the_formula(organ: RegisteredOrgan) -> None:
    points = np.concatenate([inside_points(2000, 5), organ.vertices])
    x = organ.normalisation.apply(points)
    expected = organ.T_scene_ct.apply(organ.normalisation.undo(x + organ.basis.phi(x) @ organ.z))
    assert np.abs(organ.map_points(points) - expected).max() * organ.mm_per_unit < 1e-9
    assert np.abs(organ.scene_vertices - expected[2000:]).max() * organ.mm_per_unit < 1e-9


def test_far_away_only_the_similarity_is_left(organ: RegisteredOrgan) -> None:
    points = np.concatenate([round_about(500, 31.5, 60), [[1e4, 0, 0], [-300, 500, 2000]]])
    assert np.allclose(organ.map_points(points), organ.T_scene_ct.apply(points), rtol=0, atol=1e-9)


def test_beside_the_surface_the_nearest_tissue_leads_and_the_fade_is_halfway_at_15_mm(organ: RegisteredOrgan) -> None:
    moved = np.linalg.norm(organ.surface_displacement_mm, axis=1)
    rows = np.flatnonzero(moved > 0.7 * moved.max())
    normals = organ.surface_distance.normals[rows]
    near = organ.deformation.displacement(organ.vertices[rows] + 1.0 * normals)
    assert np.abs(near - organ.surface_displacement_mm[rows]).max() < 0.1 * moved.max()
    half = np.linalg.norm(organ.deformation.displacement(organ.vertices[rows] + 15.0 * normals), axis=1)
    assert 0.35 < np.median(half / moved[rows]) < 0.65


def test_gradient_matches_differences_everywhere(organ: RegisteredOrgan) -> None:
    points, h = np.concatenate([inside_points(200, 7), round_about(1500, 0, 33)]), 1e-3
    differences = [(organ.map_points(points + h * e) - organ.map_points(points - h * e)) / (2 * h) for e in np.eye(3)]
    turned = np.stack(differences, axis=-1) / organ.T_scene_ct.scale
    expected = np.einsum("ba,nbm->nam", organ.T_scene_ct.rotation, turned)
    assert np.abs(organ.deformation_gradient(points) - expected).max() < 1e-5


def test_map_is_continuous_along_lines_through_the_surface(organ: RegisteredOrgan) -> None:
    steps = np.linspace(-3, 33, 36001)[:, None]
    for row in (100, 500, 900):
        line = organ.vertices[row] + steps * organ.surface_distance.normals[row]
        gaps = np.linalg.norm(np.diff(organ.deformation.displacement(line), axis=0), axis=1)
        assert gaps.max() < 1e-3  # 1 micrometre steps of the displacement on 1 micrometre steps of the point


def test_no_folding_beside_the_organ(organ: RegisteredOrgan) -> None:
    assert np.linalg.det(organ.deformation_gradient(round_about(4000, 0, 31))).min() > 0.3


def test_there_and_back(organ: RegisteredOrgan) -> None:
    points = np.concatenate([inside_points(500, 3), round_about(1500, 0, 40), [[900.0, 0, 0]]])
    result = organ.inverse_map(organ.map_points(points))
    assert result.converged.all()
    assert np.linalg.norm(result.points - points, axis=1).max() < 1e-4
    assert np.array_equal(organ.inverse_map_points(organ.map_points(points)), result.points)


def test_what_cannot_be_inverted_is_nan_and_said_so() -> None:
    crushed = bent_organ(strength=12.0)  # folds: some scene points have no or several origins
    result = crushed.inverse_map(crushed.map_points(round_about(300, 0, 20)))
    assert np.array_equal(np.isnan(result.points).any(1), ~result.converged)
    assert (result.residual_mm[result.converged] < 1e-5).all()
    assert result.converged.mean() > 0.5


def test_outside_distance(organ: RegisteredOrgan) -> None:
    assert not organ.outside_distance_mm(inside_points(300)).any()
    vertices, faces = ellipsoid(80, 160)
    rng = np.random.default_rng(2)
    distance = rng.uniform(0.5, 30, 400)
    points = np.concatenate([round_about(1, d, d, seed=k) for k, d in enumerate(distance)])
    surface = SurfaceDistance(vertices, faces)
    assert np.abs(surface.signed(points) - distance).max() < 0.1
    assert np.abs(surface.outside(points) / distance - 1).max() < 0.05
    coarse = SurfaceDistance(*ellipsoid())
    assert np.abs(coarse.outside(points) / coarse.signed(points) - 1)[distance > 2].max() < 0.05


def test_empty_and_bad_points(organ: RegisteredOrgan) -> None:
    assert organ.map_points(np.zeros((0, 3))).shape == (0, 3)
    assert organ.inverse_map_points(np.zeros((0, 3))).shape == (0, 3)
    with pytest.raises(InputError, match="not finite"):
        organ.map_points([[0, 0, np.nan]])
    with pytest.raises(InputError, match="shape"):
        organ.inverse_map_points(np.zeros((4, 2)))
    with pytest.raises(InputError, match="frame"):
        organ.surface(frame="lps")


def test_spline_keeps_linear_functions() -> None:
    nodes = np.stack(np.meshgrid(np.arange(7.0), np.arange(8.0), np.arange(9.0), indexing="ij"), axis=-1)
    spline = GridSpline(np.array([1.0, 2, 3]), 0.5, nodes)
    points = np.random.default_rng(0).uniform([2, 3, 4], [3, 4, 5], (50, 3))
    values, gradients = spline.values_and_gradients(points)
    assert np.allclose(values, (points - [1, 2, 3]) / 0.5)
    assert np.allclose(gradients, 2 * np.eye(3))


def test_filling_keeps_known_values_and_stays_within_their_range() -> None:
    rng = np.random.default_rng(0)
    known = rng.random((9, 10, 11)) < 0.02
    values = rng.random((9, 10, 11, 2))
    filled = fill_outwards(values, known)
    assert np.array_equal(filled[known], values[known])
    assert filled.min() >= values[known].min() - 1e-12 and filled.max() <= values[known].max() + 1e-12


def test_grid_distance_agrees_with_the_surface() -> None:
    surface = SurfaceDistance(*ellipsoid())
    low, high = CENTRE_MM - AXES_MM - 30, CENTRE_MM + AXES_MM + 30
    axes = [np.arange(low[k], high[k], 4.0) for k in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    exact = surface.signed(nodes.reshape(-1, 3)).reshape(nodes.shape[:3])
    error = grid_distance(nodes, surface, 4.0) - exact
    assert np.abs(error).max() < 0.8 and not error[np.abs(exact) < 6].any()
