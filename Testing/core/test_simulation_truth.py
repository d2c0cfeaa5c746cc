"""The simulator against an independent full finite-element solution of the same body; the benchmark has the curve."""

import numpy as np
import pytest

pytest.importorskip("skfem", reason="scikit-fem (extra 'test') is not installed")

from fem_reference import Quadratic, carried_over, solve
from truth_examples import PULL, TISSUE, body_of, load_case, mesh_of, relative_error, simulated

MATERIAL = TISSUE.material


def test_displacements_are_those_of_full_finite_elements_and_nearer_with_more_handles():
    mesh = mesh_of(3)
    loads, coarse, space = load_case(mesh, "pulled patch"), Quadratic.of(mesh), Quadratic.of(mesh.refined())
    first = solve(coarse, loads, MATERIAL.mu, MATERIAL.lam, tolerance=1e-4)
    start = carried_over(coarse, first, space)
    nodes = solve(space, loads, MATERIAL.mu, MATERIAL.lam, tolerance=1e-4, start=start)
    truth = space.at_points(nodes)
    change = relative_error(space.at_points(start), truth, space.weights)
    assert np.abs(truth).max() > 0.01 and 0.005 < change < 0.03  # a third of which is left, or less
    bodies = {handles: body_of(mesh, loads, handles) for handles in (6, 20)}
    errors = {
        k: relative_error(simulated(b, mesh, loads, space.points), truth, space.weights) for k, b in bodies.items()
    }
    assert errors[20] < 0.015 and errors[20] < 0.7 * errors[6]
    softer = bodies[20].with_tissue(
        type(TISSUE)("softer", 0.8 * TISSUE.youngs_pa, TISSUE.nu, TISSUE.density, "made up")
    )
    assert relative_error(simulated(softer, mesh, loads, space.points), truth, space.weights) > 0.1


def test_the_reference_balances_its_loads():
    mesh = mesh_of(2)
    loads = load_case(mesh, "pulled patch")
    space = Quadratic.of(mesh)
    u = space.at_points(solve(space, loads, MATERIAL.mu, MATERIAL.lam))
    springs = loads.held(space.points) * space.weights.ravel()
    assert np.allclose(springs @ u, PULL, atol=1e-6 * np.linalg.norm(PULL))
