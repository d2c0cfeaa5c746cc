"""RKPM shape functions and weights, reduced basis and reduced elasticity on an ellipsoid."""

from itertools import pairwise

import numpy as np
import pytest

from organphys.basis.learned import LearnedWeights
from organphys.basis.reduced_basis import ReducedBasis
from organphys.basis.reduced_elasticity import ReducedElasticity
from organphys.basis.reproducing_kernel import ReproducingKernel
from organphys.basis.rkpm import rkpm_weights
from organphys.basis.skinning import weights_from_arrays
from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from organphys.mechanics.neo_hookean import LogNeoHookean, StableNeoHookean


def ellipsoid(count=4000, seed=0):
    points = np.random.default_rng(seed).uniform(-1, 1, (3 * count, 3))
    return (points[(points**2).sum(1) < 1] * [1.0, 0.6, 0.4])[:count]


def small_network(seed=0, handles=4):
    rng = np.random.default_rng(seed)
    widths = [3, 12, 10, handles - 1]
    matrices = tuple(rng.normal(size=(a, b)) / np.sqrt(a) for a, b in pairwise(widths))
    return LearnedWeights(matrices, tuple(rng.normal(size=b) for b in widths[1:]), np.array([0.1, 0.0, -0.2]), 0.7)


@pytest.fixture(scope="module")
def points():
    return ellipsoid()


@pytest.fixture(scope="module")
def rkpm(points):
    return rkpm_weights(points, handles=6, nodes=120, samples=1500)


def both(rkpm):
    return {"rkpm": rkpm, "learned": small_network()}


def test_shape_functions_reproduce_affine_functions(points, rkpm):
    kernel = ReproducingKernel(rkpm.nodes, rkpm.radii)
    for at in (points[:50], 1.6 * points[:50], 30 * points[:50]):
        shapes, gradients = kernel.shapes_with_gradient(at)
        np.testing.assert_allclose(shapes.sum(1), 1, atol=1e-6)
        np.testing.assert_allclose(shapes @ kernel.nodes, at, atol=1e-6 * max(1, np.abs(at).max()))
        np.testing.assert_allclose(gradients.sum(2), 0, atol=1e-6)
        np.testing.assert_allclose(np.einsum("mni,ik->nmk", gradients, kernel.nodes), [np.eye(3)] * 50, atol=1e-5)


def test_combined_values_are_the_dense_shape_functions_times_coefficients(points, rkpm):
    kernel = ReproducingKernel(rkpm.nodes, rkpm.radii)
    at = np.concatenate([points[:30], 2 * points[:30]])
    shapes, gradients = kernel.shapes_with_gradient(at)
    values, slopes = kernel.combined_with_gradient(rkpm.coefficients, at)
    np.testing.assert_allclose(values, shapes @ rkpm.coefficients, atol=1e-10)
    np.testing.assert_allclose(slopes, np.einsum("mni,ik->nkm", gradients, rkpm.coefficients), atol=1e-8)
    np.testing.assert_allclose(kernel.combined(rkpm.coefficients, at), values, atol=1e-12)


@pytest.mark.parametrize("kind", ["rkpm", "learned"])
@pytest.mark.parametrize("away", [1.0, 1.3, 2.0, 6.0])
def test_weight_gradients_by_finite_differences(points, rkpm, kind, away):
    weights, at, step = both(rkpm)[kind], away * points[:40], 1e-6
    values, gradients = weights.values_and_gradients(at)
    np.testing.assert_allclose(values, weights.values(at), atol=1e-12)
    for m, axis in enumerate(np.eye(3)):
        expected = (weights.values(at + step * axis) - weights.values(at - step * axis)) / (2 * step)
        np.testing.assert_allclose(gradients[:, :, m], expected, rtol=1e-5, atol=1e-6 * (1 + np.abs(values).max()))


@pytest.mark.parametrize("kind", ["rkpm", "learned"])
def test_weights_come_back_from_their_arrays(points, rkpm, kind):
    weights = both(rkpm)[kind]
    again = weights_from_arrays(kind, weights.arrays())
    assert again.handles == weights.handles and again.kind == kind
    np.testing.assert_array_equal(again.values(points[:100]), weights.values(points[:100]))
    damaged = {name: array[..., :-1] for name, array in weights.arrays().items() if np.ndim(array)}
    with pytest.raises((InputError, ValueError)):
        weights_from_arrays(kind, {**weights.arrays(), **damaged})
    with pytest.raises(InputError, match="one of"):
        weights_from_arrays("other", {})
    with pytest.raises(InputError, match="damaged"):
        weights_from_arrays(kind, {"offset_0": np.zeros(3)})


def test_rkpm_weights_are_smooth_orthogonal_modes(points, rkpm):
    values = rkpm.values(points)
    assert values.shape == (len(points), 6)
    np.testing.assert_array_equal(values[:, -1], 1)
    gram = values.T @ values / len(points)
    np.testing.assert_allclose(gram, np.eye(6), atol=0.15)
    gradients = rkpm.values_and_gradients(points)[1]
    stiffness = (gradients**2).sum((0, 2)) / len(points)
    assert (np.diff(stiffness[:-1]) > -0.05 * stiffness[-2]).all(), "modes come in the order of their energy"
    # the lowest mode of a long body runs along its longest axis
    assert abs(np.corrcoef(values[:, 0], points[:, 0])[0, 1]) > 0.95


def test_lowest_eigenvalue_of_a_box_is_known():
    """Neumann Laplacian on the box 2 x 1.2 x 0.8: lowest eigenvalue (pi / 2)^2, mode sin(pi x / 2)."""
    box = np.random.default_rng(0).uniform(-1, 1, (8000, 3)) * [1.0, 0.6, 0.4]
    weights = rkpm_weights(box, handles=3, nodes=300, samples=6000)
    values, gradients = weights.values_and_gradients(box)
    rayleigh = (gradients[:, 0] ** 2).sum() / (values[:, 0] ** 2).sum()
    np.testing.assert_allclose(rayleigh, (np.pi / 2) ** 2, rtol=0.03)
    assert abs(np.corrcoef(values[:, 0], np.sin(np.pi * box[:, 0] / 2))[0, 1]) > 0.999


def test_uniform_stiffness_drops_out_and_varying_stiffness_does_not(points):
    plain = rkpm_weights(points, handles=4, nodes=80, samples=1000)
    uniform = rkpm_weights(points, handles=4, nodes=80, samples=1000, stiffness=np.full(len(points), 7.0))
    varying = rkpm_weights(points, handles=4, nodes=80, samples=1000, stiffness=np.exp(3 * points[:, 0]))
    np.testing.assert_allclose(uniform.coefficients, plain.coefficients, atol=1e-7)
    assert np.abs(varying.values(points) - plain.values(points)).max() > 0.1


def test_rkpm_is_deterministic_and_far_points_stay_finite(points, rkpm):
    again = rkpm_weights(points, handles=6, nodes=120, samples=1500)
    np.testing.assert_array_equal(again.coefficients, rkpm.coefficients)
    ray = np.linspace(0, 60, 4001)[:, None] * np.array([[0.3, -0.8, 0.52]])
    values, gradients = rkpm.values_and_gradients(ray)
    assert np.isfinite(values).all() and np.isfinite(gradients).all()
    assert np.abs(np.diff(values, axis=0)).max() < 0.015 * np.abs(gradients).max() * 1.5  # no jumps


def test_rkpm_bad_input(points):
    with pytest.raises(InputError, match="handles"):
        rkpm_weights(points[:20], handles=20)
    with pytest.raises(InputError, match="at least 8"):
        rkpm_weights(points[:3])
    with pytest.raises(InputError, match="plane"):
        rkpm_weights(points * [1.0, 1.0, 0.0], handles=4)


@pytest.mark.parametrize("kind", ["rkpm", "learned"])
@pytest.mark.parametrize("white", [False, True])
def test_similarity_coordinates_are_exact(points, rkpm, kind, white):
    weights = both(rkpm)[kind]
    basis = ReducedBasis.whitened(weights, points[:1000]) if white else ReducedBasis.plain(weights)
    matrix, shift = 0.3 * rotation_about(np.array([1.0, 1.0, 0.2]), 0.7), np.array([0.1, -0.4, 2.0])
    z = basis.similarity_coordinates(matrix, shift)
    for at in (points[:50], 3 * points[:50]):
        np.testing.assert_allclose(basis.phi(at) @ z, at @ matrix.T + shift, atol=1e-9)


def test_basis_gradient_by_finite_differences(points, rkpm):
    basis, step = ReducedBasis.whitened(rkpm, points), 1e-6
    phi, gradient = basis.phi_and_gradient(points[:30])
    assert phi.shape == (30, 24) and gradient.shape == (3, 30, 24)
    np.testing.assert_allclose(phi, basis.phi(points[:30]), atol=1e-12)
    for m, axis in enumerate(np.eye(3)):
        expected = (basis.phi(points[:30] + step * axis) - basis.phi(points[:30] - step * axis)) / (2 * step)
        np.testing.assert_allclose(gradient[m], expected, rtol=1e-5, atol=1e-6 * np.abs(gradient).max())


@pytest.mark.parametrize("kind", ["rkpm", "learned"])
def test_displacement_without_the_basis_is_that_of_the_basis(points, rkpm, kind):
    basis = ReducedBasis.whitened(both(rkpm)[kind], points)
    z = np.random.default_rng(8).normal(size=(basis.size, 3))
    for at in (points[:40], 4 * points[:40]):
        phi, slopes = basis.phi_and_gradient(at)
        moved, gradient = basis.displacement_and_gradient(z, at)
        scale = np.abs(phi @ z).max()
        np.testing.assert_allclose(moved, phi @ z, atol=1e-11 * scale)
        np.testing.assert_allclose(basis.displacement(z, at), phi @ z, atol=1e-11 * scale)
        np.testing.assert_allclose(gradient, (slopes @ z).transpose(1, 2, 0), atol=1e-10 * scale)


def test_whitened_columns_are_orthonormal_in_the_mean_and_stored(points, rkpm):
    basis = ReducedBasis.whitened(rkpm, points)
    phi = basis.phi(points)
    np.testing.assert_allclose(phi.T @ phi / len(points), np.eye(basis.size), atol=1e-9)
    again = ReducedBasis.from_arrays("rkpm", basis.arrays())
    np.testing.assert_array_equal(again.phi(points[:10]), basis.phi(points[:10]))


@pytest.fixture(scope="module", params=[LogNeoHookean, StableNeoHookean], ids=["log", "stable"])
def elastic(request, points, rkpm):
    basis = ReducedBasis.whitened(rkpm, points)
    return basis, ReducedElasticity.at(basis, points[:200], request.param.from_youngs(1.0, 0.45), volume=2.0)


def test_reduced_gradient_and_hessian_by_finite_differences(elastic):
    basis, elasticity = elastic
    rng, step = np.random.default_rng(5), 1e-6
    z = 0.003 * rng.normal(size=(basis.size, 3))
    energy, gradient = elasticity.energy_and_gradient(z)
    assert energy == pytest.approx(elasticity.energy(z)) and elasticity.min_det(z) > 0
    hessian = elasticity.hessian(z, project=False)
    for _ in range(6):
        d = rng.normal(size=z.shape)
        e = [elasticity.energy_and_gradient(z + sign * step * d) for sign in (1, -1)]
        np.testing.assert_allclose((gradient * d).sum(), (e[0][0] - e[1][0]) / (2 * step), rtol=1e-6)
        expected = ((e[0][1] - e[1][1]) / (2 * step)).ravel()
        np.testing.assert_allclose(hessian @ d.ravel(), expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_rest_hessian_is_the_hessian_at_rest(elastic):
    basis, elasticity = elastic
    full = elasticity.hessian(np.zeros((basis.size, 3)), project=False)
    np.testing.assert_allclose(elasticity.rest_hessian(), full, atol=1e-10 * np.abs(full).max())


def test_deformation_gradient_of_an_affine_map_and_rigid_motion_costs_nothing(elastic):
    basis, elasticity = elastic
    rotation = rotation_about(np.array([0.0, 1.0, 1.0]), 0.9)
    z = basis.similarity_coordinates(rotation - np.eye(3), np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(elasticity.deformation_gradient(z), [rotation] * 200, atol=1e-9)
    assert abs(elasticity.energy(z)) < 1e-12 and np.abs(elasticity.energy_and_gradient(z)[1]).max() < 1e-8
    stretch = np.diag([1.1, 0.95, 1.02])
    z = basis.similarity_coordinates(stretch - np.eye(3), np.zeros(3))
    np.testing.assert_allclose(elasticity.energy(z), 2.0 * elasticity.material.energy(stretch[None])[0], rtol=1e-9)
    np.testing.assert_allclose(elasticity.determinants(z), np.linalg.det(stretch), rtol=1e-9)


def test_log_energy_guards_the_reduced_model(points, rkpm):
    basis = ReducedBasis.plain(rkpm)
    elasticity = ReducedElasticity.at(basis, points[:50], LogNeoHookean(1.0, 1.0))
    energy, gradient = elasticity.energy_and_gradient(basis.similarity_coordinates(-2 * np.eye(3), np.zeros(3)))
    assert np.isinf(energy) and np.isfinite(gradient).all()
