"""A liver-like ellipsoid of tetrahedra under two static loads, for the simulator and for full finite elements."""

import numpy as np
from fem_reference import Loads, Quadratic, boundary, ellipsoid_mesh

from organphys.mechanics.tissue import Tissue
from organphys.simulation.body import held_body
from organphys.simulation.rest_shape import rest_shape

RADII = np.array([0.06, 0.04, 0.03])
TISSUE = Tissue("liver-like", 5500.0, 0.45, 1060.0, "round numbers")
HOLD = 2e3  # N/m of all springs together: tissue held so gives way over about 10 mm, which the meshes resolve
PULL = np.array([0.0, 0.2, 0.3])  # N on the whole patch
LOADS = ("weight", "pulled patch")


def mesh_of(cells):
    return ellipsoid_mesh(RADII, cells)


def load_case(mesh, name):
    """One half is held, the firmer the farther out; either all of it has weight, or the other end is pulled."""
    space = Quadratic.of(mesh)
    springs, pulls = (float(space.weights.ravel() @ bump(space.points)) for bump in (_held, _pulled))
    if name == "weight":
        force = TISSUE.density * np.array([0, 0, -9.81])
        return Loads(lambda x: HOLD / springs * _held(x), lambda x: np.tile(force, (len(x), 1)))
    return Loads(lambda x: HOLD / springs * _held(x), lambda x: np.outer(_pulled(x), PULL / pulls))


def _held(x):
    return _rise((0.2 - x[:, 0] / RADII[0]) / 1.2)


def _pulled(x):
    return _rise((x[:, 0] / RADII[0] - 0.3) / 0.7)


def _rise(t):
    """From 0 at 0 to 1 at 1, twice continuous."""
    t = np.clip(t, 0.0, 1.0)
    return t**3 * (10 - 15 * t + 6 * t**2)


def body_of(mesh, loads, handles, quadrature=2000):
    """The simulator's body on the middles of tetrahedra two levels finer: the same polyhedron, evenly filled."""
    fine = mesh.refined(2)
    points, volumes = fine.p[:, fine.t].mean(1).T, Quadratic.of(fine).weights.sum(1)
    springs = loads.held(points) * volumes
    pinned = springs > 0
    shape = rest_shape(
        points, volumes, *boundary(mesh), tissue=TISSUE, handles=handles, quadrature=quadrature, sample_spacing=0.01
    )
    return held_body(shape, points[pinned], springs[pinned], tissue=TISSUE)


def simulated(body, mesh, loads, points):
    """Displacements (N, 3) m of the static equilibrium at points (N, 3), by Newton's method on the body's energy."""
    space = Quadratic.of(mesh)
    force = body.basis.phi(space.points).T @ (space.weights.reshape(-1, 1) * loads.force(space.points))
    z, held = np.zeros((body.basis.size, 3)), np.kron(body.held, np.eye(3))
    for part in (0.25, 0.5, 0.75, 1.0):
        for _ in range(30):
            gradient = body.elasticity.energy_and_gradient(z)[1] + body.held @ z - part * force
            way = np.linalg.solve(body.elasticity.hessian(z) + held, -gradient.ravel()).reshape(z.shape)
            length = 1.0
            while body.strain.determinants(z + length * way).min() <= 0:
                length *= 0.5
            z = z + length * way
            if np.abs(way).max() < 1e-7 * np.abs(z).max():
                break
    return body.basis.phi(points) @ z


def relative_error(u, truth, weights):
    """rms of u - truth over the volume in parts of the rms of truth; (N, 3) each, weights of N points."""
    w = weights.ravel()
    return float(np.sqrt((w @ ((u - truth) ** 2).sum(1)) / (w @ (truth**2).sum(1))))
