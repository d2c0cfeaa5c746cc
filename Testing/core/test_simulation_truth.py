"""The simulator against an independent full finite-element solution of the same body; the benchmark has the curve."""

import numpy as np
import pytest

pytest.importorskip("skfem", reason="scikit-fem (extra 'test') is not installed")

from fem_reference import Quadratic, refined, solve
from truth_examples import PULL, TISSUE, body_of, load_case, mesh_of, relative_error, simulated

MATERIAL = TISSUE.material


def test_displacements_are_those_of_full_finite_elements():
    mesh = mesh_of(3)
    loads = load_case(mesh, "pulled patch")
    fine, fine_loads = refined(mesh, loads)
    space = Quadratic.of(fine)
    nodes = solve(space, fine_loads, MATERIAL.mu, MATERIAL.lam, tolerance=1e-4, parts=2)
    truth = space.at_points(nodes)
    assert np.abs(truth).max() > 0.003
    body = body_of(mesh, loads, 20)
    error = relative_error(simulated(body, mesh, loads, space.points), truth, space.weights)
    assert error < 0.05  # the reference itself is good to about 0.02 here
    softer = body.with_tissue(type(TISSUE)("softer", 0.8 * TISSUE.youngs_pa, TISSUE.nu, TISSUE.density, "made up"))
    assert relative_error(simulated(softer, mesh, loads, space.points), truth, space.weights) > 0.15


def test_the_reference_balances_its_loads():
    mesh = mesh_of(2)
    loads = load_case(mesh, "pulled patch")
    space = Quadratic.of(mesh)
    u = space.at_points(solve(space, loads, MATERIAL.mu, MATERIAL.lam))
    springs = loads.held * np.repeat(loads.pinned, space.weights.shape[1]) * space.weights.ravel()
    assert np.allclose(springs @ u, PULL, atol=1e-6 * np.linalg.norm(PULL))
