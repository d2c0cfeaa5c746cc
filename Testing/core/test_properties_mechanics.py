"""Identities of the mechanics that hold for every material and deformation, not for the examples alone."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from organphys.mechanics.neo_hookean import LogNeoHookean, StableNeoHookean, lame_constants, project_to_psd

YOUNGS = st.floats(1.0, 1e6)
POISSON = st.floats(0.0, 0.495)
SEED = st.integers(0, 2**32 - 1)
LAWS = st.sampled_from([StableNeoHookean, LogNeoHookean])
many = settings(max_examples=60, deadline=None, derandomize=True)


def deformations(seed: int, *, count: int = 4, amount: float = 0.3) -> np.ndarray:
    """F (count, 3, 3) with det F well above 0, turned by any rotation."""
    rng = np.random.default_rng(seed)
    stretch = np.eye(3) + rng.uniform(-amount, amount, (count, 3, 3)) / 2
    return Rotation.random(count, random_state=seed).as_matrix() @ stretch


def along(seed: int) -> np.ndarray:
    """A direction (3, 3) of unit length."""
    direction = np.random.default_rng(seed + 1).normal(size=(3, 3))
    return direction / np.linalg.norm(direction)


@many
@given(YOUNGS, POISSON)
def test_lame_constants_give_young_poisson_and_bulk_back(youngs, nu):
    mu, lam = lame_constants(youngs, nu)
    np.testing.assert_allclose(mu * (3 * lam + 2 * mu) / (lam + mu), youngs, rtol=1e-12)
    np.testing.assert_allclose(lam / (2 * (lam + mu)), nu, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(lam + 2 * mu / 3, youngs / (3 * (1 - 2 * nu)), rtol=1e-9)


@many
@given(LAWS, YOUNGS, POISSON, SEED)
def test_stress_and_hessian_are_derivatives_along_any_direction(law, youngs, nu, seed):
    """Richardson's extrapolation of central differences: errors of order h^4."""
    material, f, direction, h = law.from_youngs(youngs, nu), deformations(seed), along(seed), 1e-3

    def slope(function):
        near = (function(f + h * direction) - function(f - h * direction)) / (2 * h)
        far = (function(f + 2 * h * direction) - function(f - 2 * h * direction)) / (4 * h)
        return (4 * near - far) / 3

    stiff = youngs / (1 - 2 * nu)
    stress = material.energy_and_stress(f)[1]
    np.testing.assert_allclose((stress * direction).sum((1, 2)), slope(material.energy), atol=1e-7 * stiff)
    hessian = material.hessian(f, project=False)
    expected = slope(lambda x: material.energy_and_stress(x)[1]).reshape(-1, 9)
    np.testing.assert_allclose(hessian @ direction.ravel(), expected, atol=1e-7 * stiff)
    np.testing.assert_allclose(hessian, hessian.transpose(0, 2, 1), atol=1e-12 * stiff)


@many
@given(LAWS, YOUNGS, POISSON, SEED)
def test_no_observer_and_no_direction_is_preferred(law, youngs, nu, seed):
    """psi(QF) = psi(FQ) = psi(F), P(QF) = Q P(F), and the Kirchhoff stress P F^T is symmetric: no torque arises."""
    material, f, q = law.from_youngs(youngs, nu), deformations(seed), Rotation.random(random_state=seed).as_matrix()
    stiff = youngs / (1 - 2 * nu)
    energy, stress = material.energy_and_stress(f)
    np.testing.assert_allclose(material.energy(q @ f), energy, atol=1e-12 * stiff)
    np.testing.assert_allclose(material.energy(f @ q), energy, atol=1e-12 * stiff)
    np.testing.assert_allclose(material.energy_and_stress(q @ f)[1], q @ stress, atol=1e-12 * stiff)
    kirchhoff = stress @ f.transpose(0, 2, 1)
    np.testing.assert_allclose(kirchhoff, kirchhoff.transpose(0, 2, 1), atol=1e-12 * stiff)


@many
@given(LAWS, YOUNGS, POISSON, SEED)
def test_rest_is_the_least_energy_and_small_strain_is_hookes_law(law, youngs, nu, seed):
    material = law.from_youngs(youngs, nu)
    mu, lam = lame_constants(youngs, nu)
    strain = along(seed) + along(seed).T
    small = 1e-6 * strain
    stress = material.energy_and_stress(np.eye(3)[None] + small)[1][0]
    hooke = 2 * mu * small + lam * np.trace(small) * np.eye(3)
    np.testing.assert_allclose(stress, hooke, atol=1e-4 * np.abs(hooke).max() + 1e-15 * youngs / (1 - 2 * nu))
    assert (material.energy(deformations(seed, amount=0.2)) >= -1e-12 * youngs / (1 - 2 * nu)).all()


@many
@given(st.integers(1, 12), SEED)
def test_projection_is_the_nearest_semi_definite_matrix(size, seed):
    """Idempotent, semi-definite, and what it takes away is orthogonal to what it leaves (Higham 1988)."""
    a = np.random.default_rng(seed).normal(size=(3, size, size))
    a = a + a.transpose(0, 2, 1)
    projected = project_to_psd(a)
    assert np.linalg.eigvalsh(projected).min() > -1e-12 * size
    np.testing.assert_allclose(project_to_psd(projected), projected, atol=1e-12 * size)
    np.testing.assert_allclose(((a - projected) * projected).sum((1, 2)), 0, atol=1e-10 * size)
