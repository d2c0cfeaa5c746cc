"""Derivatives by finite differences, identities of the energies, and the solvers on known problems."""

import numpy as np
import pytest
import scipy.linalg

from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from organphys.ground.solve_report import Stop
from organphys.mechanics.determinant import cofactor, cofactor_derivative
from organphys.mechanics.lbfgs import minimise
from organphys.mechanics.neo_hookean import LogNeoHookean, NeoHookean, StableNeoHookean, lame_constants, project_to_psd
from organphys.mechanics.newton import newton
from organphys.mechanics.tissue import GENERIC, PRESETS, Tissue, tissue_for

MATERIALS = [StableNeoHookean(2.0, 7.0), LogNeoHookean(2.0, 7.0)]
BOTH = pytest.mark.parametrize("material", MATERIALS, ids=["stable", "log"])


def gradients(count=7, amount=0.2, seed=0):
    return np.eye(3) + np.random.default_rng(seed).uniform(-amount, amount, (count, 3, 3))


def differences(function, f, step=1e-6):
    """Central differences of function(F) (Q, ...) along each of the nine entries: (Q, ..., 9)."""
    entries = np.eye(9).reshape(9, 3, 3)
    return np.stack([(function(f + step * e) - function(f - step * e)) / (2 * step) for e in entries], axis=-1)


@BOTH
def test_stress_is_the_derivative_of_the_energy(material):
    f = gradients()
    expected = differences(material.energy, f).reshape(-1, 3, 3)
    np.testing.assert_allclose(material.energy_and_stress(f)[1], expected, rtol=1e-6, atol=1e-8)


@BOTH
def test_hessian_is_the_derivative_of_the_stress(material):
    f = gradients(seed=1)
    expected = differences(lambda x: material.energy_and_stress(x)[1].reshape(-1, 9), f)
    hessian = material.hessian(f, project=False)
    np.testing.assert_allclose(hessian, expected, rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(hessian, hessian.transpose(0, 2, 1), atol=1e-12)


@BOTH
def test_rest_state_has_no_energy_and_no_stress(material):
    energy, stress = material.energy_and_stress(np.eye(3)[None])
    np.testing.assert_allclose(energy, 0, atol=1e-14)
    np.testing.assert_allclose(stress, 0, atol=1e-14)


@BOTH
def test_hessian_at_rest_is_linear_elasticity(material):
    delta = np.eye(3)
    expected = material.lam * np.einsum("am,bn->ambn", delta, delta)
    expected += material.mu * (np.einsum("ab,mn->ambn", delta, delta) + np.einsum("an,bm->ambn", delta, delta))
    hessian = material.hessian(np.eye(3)[None], project=False)[0]
    np.testing.assert_allclose(hessian, expected.reshape(9, 9), atol=1e-12)


@BOTH
def test_energy_does_not_feel_rotation(material):
    f, rotation = gradients(seed=2), rotation_about(np.array([1.0, 2.0, -1.0]), 1.1)
    energy, stress = material.energy_and_stress(f)
    turned_energy, turned_stress = material.energy_and_stress(rotation @ f)
    np.testing.assert_allclose(turned_energy, energy, rtol=1e-12)
    np.testing.assert_allclose(turned_stress, rotation @ stress, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(material.energy(f @ rotation), energy, rtol=1e-12)  # isotropic


@BOTH
def test_uniaxial_tension_shows_youngs_modulus_and_poissons_ratio(material):
    """Solve for the lateral stretch that leaves the sides free: small strain must give E and nu back."""
    youngs, nu, strain = 3000.0, 0.4, 1e-5
    law = type(material).from_youngs(youngs, nu)

    def sides(lateral):
        f = np.diag([1 + strain, 1 + lateral, 1 + lateral])[None]
        return law.energy_and_stress(f)[1][0]

    a, b = -0.6 * strain, 0.0
    for _ in range(60):
        middle = (a + b) / 2
        a, b = (middle, b) if sides(middle)[1, 1] < 0 else (a, middle)
    np.testing.assert_allclose(-a / strain, nu, rtol=1e-4)
    np.testing.assert_allclose(sides(a)[0, 0] / strain, youngs, rtol=1e-4)


def test_log_energy_is_infinite_when_inside_out_and_stable_energy_is_not():
    f = np.stack([np.diag([1.0, 1.0, 0.0]), np.diag([1.0, 1.0, -0.5]), np.diag([1.0, 1.0, 1e-12])])
    log, stress = LogNeoHookean(1.0, 1.0).energy_and_stress(f)
    assert np.isinf(log[:2]).all() and log[2] > 20 and np.isfinite(stress).all()
    assert np.isfinite(StableNeoHookean(1.0, 1.0).energy(f)).all()


@BOTH
def test_projected_hessian_is_semi_definite_and_changes_only_negative_modes(material):
    f = gradients(40, 0.9, seed=3)
    f = f[np.linalg.det(f) > 0.02]
    plain, projected = material.hessian(f, project=False), material.hessian(f, project=True)
    values, vectors = np.linalg.eigh(plain)
    assert (values < -1e-3).any(), "the test needs indefinite Hessians"
    assert np.linalg.eigvalsh(projected).min() > -1e-8 * np.abs(values).max()
    kept = np.einsum("qki,qkl,qlj->qij", vectors, projected, vectors)
    expected = np.maximum(values, 0)
    np.testing.assert_allclose(np.einsum("qii->qi", kept), expected, atol=1e-8 * np.abs(values).max())


def test_project_to_psd_known_answer():
    np.testing.assert_allclose(project_to_psd(np.diag([2.0, -1.0])[None])[0], np.diag([2.0, 0.0]), atol=1e-15)


def test_cofactor_and_its_derivative():
    f = gradients(5, 0.8, seed=4)
    cof = cofactor(np.ascontiguousarray(f.transpose(1, 2, 0))).transpose(2, 0, 1)
    np.testing.assert_allclose(cof, np.linalg.det(f)[:, None, None] * np.linalg.inv(f).transpose(0, 2, 1), rtol=1e-10)
    expected = differences(lambda x: np.linalg.det(x)[:, None, None] * np.linalg.inv(x).transpose(0, 2, 1), f)
    np.testing.assert_allclose(cofactor_derivative(f), expected.reshape(-1, 9, 9), rtol=1e-6, atol=1e-8)


def test_lame_constants():
    mu, lam = lame_constants(2.6, 0.3)
    np.testing.assert_allclose([mu, lam], [1.0, 1.5], rtol=1e-14)
    for bad in (0.5, -0.1, float("nan")):
        with pytest.raises(InputError, match="Poisson"):
            LogNeoHookean.from_youngs(1.0, bad)
    with pytest.raises(InputError, match="Young"):
        NeoHookean.from_youngs(0.0, 0.3)


def quartic(seed=0, size=25):
    a = np.random.default_rng(seed).normal(size=(size, size))
    a = a @ a.T + np.eye(size)

    def fun(x):
        return float(0.5 * x @ a @ x + (x**4).sum() - x.sum()), a @ x + 4 * x**3 - 1

    return a, fun


def test_lbfgs_and_newton_meet_at_the_minimum():
    a, fun = quartic()
    factor = scipy.linalg.cho_factor(a)
    x, report = minimise(fun, np.zeros(25), precondition=lambda g: scipy.linalg.cho_solve(factor, g), steps=40)
    y, newton_report = newton(fun, lambda x: a + np.diag(12 * x**2), np.zeros(25))
    assert report.stop is Stop.CONVERGED and newton_report.stop is Stop.CONVERGED
    assert np.abs(fun(x)[1]).max() < 1e-4 and np.abs(fun(y)[1]).max() < 1e-6
    np.testing.assert_allclose(x, y, atol=1e-5)
    assert report.iterations < 15 and newton_report.iterations < 8


def test_newton_converges_quadratically():
    a, fun = quartic(1)
    best = newton(fun, lambda x: a + np.diag(12 * x**2), np.zeros(25), steps=50, tolerance=1e-28)[0]
    errors = [
        np.linalg.norm(newton(fun, lambda x: a + np.diag(12 * x**2), np.zeros(25), steps=k, tolerance=0)[0] - best)
        for k in (1, 2, 3)
    ]
    assert errors[1] < 10 * errors[0] ** 2 and errors[2] < 10 * errors[1] ** 2


@pytest.mark.parametrize("beyond", [float("inf"), float("-inf"), float("nan")])
def test_solvers_never_accept_an_energy_that_is_not_finite(beyond):
    """x^2 - log(x) with steps across 0: the wall must hold, the minimum is sqrt(1/2)."""

    def fun(x):
        if x[0] <= 0:
            return beyond, np.array([0.0])
        return float(x[0] ** 2 - np.log(x[0])), np.array([2 * x[0] - 1 / x[0]])

    for start in (0.01, 30.0):
        x, report = minimise(fun, np.array([start]), precondition=lambda g: 10 * g, steps=60, tolerance=1e-14)
        np.testing.assert_allclose(x, np.sqrt(0.5), rtol=1e-5)
        assert report.evaluations > report.iterations
    with pytest.raises(ValueError, match="finite"):
        minimise(fun, np.array([-1.0]), precondition=lambda g: g)


def test_solver_says_why_it_stopped():
    _, fun = quartic()
    assert minimise(fun, np.zeros(25), precondition=lambda g: 1e-3 * g, steps=2)[1].stop is Stop.STEP_LIMIT
    wrong = minimise(lambda x: (fun(x)[0], -fun(x)[1]), np.zeros(25), precondition=lambda g: g)[1]
    assert wrong.stop is Stop.STALLED


def test_tissue_presets_are_sourced_and_found_by_name():
    assert {"liver", "spleen", "kidney", "pancreas", "prostate", "gallbladder"} < set(PRESETS)
    assert all(tissue.source and 1000 <= tissue.youngs_pa <= 50000 for tissue in PRESETS.values())
    assert tissue_for("Left Kidney") is PRESETS["kidney"] and tissue_for("gall bladder") is PRESETS["gallbladder"]
    assert tissue_for("duodenum") is GENERIC
    np.testing.assert_allclose(PRESETS["liver"].material.mu, 5500 / 2.9)
    with pytest.raises(InputError):
        Tissue("x", 1.0, 0.5, 1000.0, "")
