"""Basis, quadrature, contact samples and local functions of the simulator, against known integrals and differences."""

import numpy as np
import pytest
import scipy.linalg
from scipy.spatial import cKDTree
from simulation_examples import BOTTOM, SIZE, TISSUE, box_body, box_grid, box_surface

from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from organphys.simulation import local_following
from organphys.simulation.contact_samples import contact_samples
from organphys.simulation.elastic_modes import lowest_modes
from organphys.simulation.local_detail import LocalDetail, with_detail
from organphys.simulation.local_following import detail_state, followed
from organphys.simulation.local_functions import LocalFunctions
from organphys.simulation.pins import BoxPin, Pin
from organphys.simulation.quadrature import cell_quadrature
from organphys.simulation.rest_shape import rest_shape
from organphys.simulation.state import BodyState, Touch
from organphys.simulation.stiffness_matrix import stiffness_matrix

NEAR = LocalDetail(radius=0.01, follow=0.2)  # in a small box


def test_mass_matrix_is_the_mass_times_the_identity():
    for body in (box_body(), box_body(BOTTOM)):
        phi = body.basis.phi(body.shape.points)
        gram = phi.T @ phi / len(phi)
        assert np.abs(gram - np.eye(body.basis.size)).max() < 1e-9
        assert body.mass == pytest.approx(TISSUE.density * SIZE.prod())
        assert 4 * 8 - 4 <= body.basis.size <= 4 * 8


@pytest.mark.parametrize("local", [False, True])
def test_slopes_of_the_basis_match_differences(local):
    body = box_body()
    if local:
        body = with_detail(body, np.array([0.05, 0.02, 0.04]), NEAR)
    x = np.random.default_rng(0).uniform(0.2, 0.8, (20, 3)) * SIZE
    x[:5] = [0.05, 0.02, 0.037] + 1e-3 * x[:5]
    phi, slopes = body.basis.phi_and_gradient(x)
    assert np.allclose(phi, body.basis.phi(x), atol=1e-10)
    step = 1e-6
    for m in range(3):
        move = step * np.eye(3)[m]
        difference = (body.basis.phi(x + move) - body.basis.phi(x - move)) / (2 * step)
        assert np.abs(difference - slopes[m]).max() < 1e-6 * np.abs(slopes[m]).max()


def test_affine_motion_is_exact():
    body, rng = box_body(), np.random.default_rng(1)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    z = body.basis.affine_coordinates(matrix, shift)
    x = rng.uniform(size=(30, 3)) * SIZE
    assert np.allclose(body.basis.phi(x) @ z, x @ matrix.T + shift, atol=1e-10)
    assert np.allclose(body.strain.gradients(z).transpose(2, 0, 1), np.eye(3) + matrix, atol=1e-9)


def test_elastic_modes_of_a_free_body_do_not_repeat_rigid_motions():
    body = box_body()
    eigenvalues = np.linalg.eigvalsh(body.elasticity.rest_hessian())
    assert np.abs(eigenvalues[:6]).max() < 1e-6 * eigenvalues[6]


def test_lowest_modes_are_those_of_the_pair_of_matrices():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(30, 30)), rng.normal(size=(10, 10))
    stiffness, mass = a @ a.T, b @ b.T + np.eye(10)
    modes, whole = lowest_modes(stiffness, mass, 4), np.kron(mass, np.eye(3))
    values, vectors = scipy.linalg.eigh(stiffness, whole)
    assert np.allclose(modes.T @ whole @ modes, np.eye(4), atol=1e-10)
    assert np.allclose(np.abs(np.diag(modes.T @ whole @ vectors[:, :4])), 1, atol=1e-8)
    assert np.allclose(np.diag(modes.T @ stiffness @ modes), values[:4])


def test_quadrature_keeps_volume_and_first_moments():
    rng = np.random.default_rng(0)
    points, volumes = rng.normal(size=(3000, 3)), rng.uniform(1, 2, 3000)
    (cells, weights), owner = cell_quadrature(points, volumes, 200, 0)
    assert len(cells) <= 200 and len(owner) == 3000
    assert weights.sum() == pytest.approx(volumes.sum())
    assert np.allclose(weights @ cells, volumes @ points)


def test_refined_cells_keep_their_volume_whatever_else_was_asked_for():
    body = box_body(BOTTOM)
    cells, other = body.refined(0.0015), box_body(BOTTOM).with_tissue(body.tissue).refined(0.0015)
    fine = cells.of(np.array([3, 40, 41]))
    assert fine.weights.sum() == pytest.approx(body.strain.weights[[3, 40, 41]].sum())
    assert len(fine.points) > 3 * 10 and fine.phi.shape == (len(fine.points), body.basis.size)
    again = other.of(np.array([41, 7])).phi
    assert np.array_equal(again[: len(cells.of(np.array([41])).phi)], cells.of(np.array([41])).phi)
    with pytest.raises(InputError, match="no tissue"):
        with_detail(body, np.array([1.0, 0, 0]), LocalDetail())


def test_contact_samples_cover_the_surface_and_share_its_area():
    vertices, faces = box_surface(SIZE, 0.01)
    spacing = 1.2e-3
    samples = contact_samples(vertices, faces, spacing)
    area = 2 * (SIZE[0] * SIZE[1] + SIZE[1] * SIZE[2] + SIZE[2] * SIZE[0])
    assert samples.areas.sum() == pytest.approx(area)
    rng = np.random.default_rng(0)
    corners = vertices[faces[rng.integers(len(faces), size=5000)]]
    anywhere = np.einsum("nk,nkd->nd", rng.dirichlet([1, 1, 1], 5000), corners)
    assert cKDTree(samples.points).query(anywhere)[0].max() < spacing
    assert (np.diff(samples.starts) > 0).all()
    for patch in range(len(samples.middle)):
        members = samples.points[samples.starts[patch] : samples.starts[patch + 1]]
        away = np.linalg.norm(members - samples.points[samples.middle[patch]], axis=1)
        assert away.max() <= samples.reach[patch] + 1e-12


def test_local_functions_vanish_at_their_reach_and_have_exact_slopes():
    rng = np.random.default_rng(2)
    functions = LocalFunctions(rng.uniform(-0.005, 0.005, (6, 3)), 0.008, np.zeros(3))
    x = rng.uniform(-0.012, 0.012, (40, 3))
    values, slopes = functions.values_and_gradients(x)
    assert np.allclose(values, functions.values(x), atol=1e-14)
    for m in range(3):
        move = 1e-7 * np.eye(3)[m]
        difference = (functions.values(x + move) - functions.values(x - move)) / 2e-7
        assert np.abs(difference - slopes[m]).max() < 1e-5 * np.abs(slopes).max()
    away = x / np.linalg.norm(x, axis=1, keepdims=True) * functions.reach
    assert not functions.values(away).any()


def test_local_columns_are_orthonormal_and_come_and_go_without_a_trace():
    body = box_body(BOTTOM)
    first = with_detail(body, np.array([0.05, 0.02, 0.04]), NEAR)
    weights = first.strain.weights / first.strain.weights.sum()
    n = body.basis.size
    local = first.basis.phi(first.strain.points)[:, n:]
    count = local.shape[1]
    assert 10 <= count <= 32
    assert np.abs(local.T @ (weights[:, None] * local) - np.eye(count)).max() < 0.15  # cells resolve the rest coarsely
    state = BodyState.at_rest(first.basis.size)
    z = np.random.default_rng(3).normal(size=(first.basis.size, 3))
    moved = detail_state(BodyState(z, z, z, z, z), first, with_detail(first, np.array([0.05, 0.02, 0.04]), NEAR))
    assert np.allclose(moved.z[:n], z[:n]) and moved.z.shape == state.z.shape
    assert np.allclose(moved.z[n:], z[n:], atol=1e-9)
    assert first.plain is body


def test_local_functions_that_move_on_leave_the_shape_as_it_is(monkeypatch):
    monkeypatch.setattr(local_following, "MOST", 3)
    body, detail = box_body(BOTTOM), NEAR
    first = with_detail(body, np.array([0.05, 0.02, 0.04]), detail)
    size = first.basis.size
    z = 1e-6 * np.random.default_rng(3).normal(size=(size, 3))
    top = np.flatnonzero(body.samples.points[:, 2] > SIZE[2] - 1e-6)
    touched = top[np.abs(body.samples.points[top, :2] - [0.053, 0.02]).max(1) < 0.003]
    touch = Touch(touched, 0 * touched, np.ones(len(touched)), np.tile([0, 0, 1.0], (len(touched), 1)))
    state = BodyState(z, 2 * z, z, z, z, touch=touch)
    second, moved = followed(first, state, detail)
    assert len(second.basis.local.functions.centres) > len(first.basis.local.functions.centres)
    shift = second.sample_positions(moved.z, top) - first.sample_positions(z, top)
    assert np.abs(shift).max() < 1e-9 * np.abs(z).max()
    speed = second.sample_phi(top) @ moved.velocity - first.sample_phi(top) @ state.velocity
    assert np.abs(speed).max() < 1e-9 * np.abs(z).max()


def test_stiffness_matrix_is_the_hessian_and_its_definite_part_is_definite():
    body = box_body(BOTTOM)
    z = np.random.default_rng(0).normal(size=(body.basis.size, 3))
    z *= 0.5 / np.abs(body.strain.rates(z)).max()
    exact, single = body.elasticity.hessian(z), stiffness_matrix(body.strain, z)
    assert np.abs(single - exact).max() < 1e-5 * np.abs(exact).max()
    definite = stiffness_matrix(body.strain, z, definite=True)
    assert np.linalg.eigvalsh(definite)[0] > -1e-5 * np.abs(exact).max() > np.linalg.eigvalsh(-definite)[0]


def test_pins_that_hold_nothing_and_bad_volumes_are_refused():
    with pytest.raises(InputError, match="no tissue within its 5 mm"):
        box_body().with_pins(Pin((1.0, 0, 0), 0.005))
    with pytest.raises(InputError, match="volumes"):
        rest_shape(box_grid(SIZE, 0.01), np.ones(3), *box_surface(SIZE, 0.01))
    with pytest.raises(InputError, match="pin radius"):
        Pin((0, 0, 0), 0.0)


def test_a_box_pin_holds_what_is_in_the_box():
    turn = rotation_about(np.array([0.0, 0.0, 1.0]), 0.5)
    box = BoxPin((0.05, 0.02, 0.02), tuple(map(tuple, turn)), (0.06, 0.02, 0.1), 1000.0)
    body = box_body(box)
    everything = np.concatenate([body.shape.points, body.samples.points])
    local = (everything - [0.05, 0.02, 0.02]) @ turn.T
    inside = (np.abs(local) <= [0.03, 0.01, 0.05]).all(1)
    assert 0 < inside.sum() < len(everything)
    assert np.array_equal(body.held_points, everything[inside])
    assert body.springs.sum() == pytest.approx(1000.0)
    corner = np.array([[0.033, 0.014, 0.05]])  # 3 mm and 4 mm beside an edge
    assert box.distances(corner @ turn + [0.05, 0.02, 0.02]) == pytest.approx(0.005)
    with pytest.raises(InputError, match="no tissue within its 10 x 10 x 10 mm"):
        body.with_pins(BoxPin((1.0, 0.0, 0.0), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), (0.01, 0.01, 0.01)))
    with pytest.raises(InputError, match="right angles"):
        BoxPin((0.0, 0.0, 0.0), ((1, 0, 0), (1, 0, 0), (0, 0, 1)), (0.01, 0.01, 0.01))
