"""The benchmark's finite elements: derivatives against differences, and elastic ICP against known answers."""

import bench_examples  # noqa: F401  (puts the benchmarks on the path)
import numpy as np
import pytest

from organphys.ground.frames import rotation_about
from organphys.mechanics.neo_hookean import LogNeoHookean
from organphys_bench.fem.assembly import Assembly, Elasticity, spring_entries
from organphys_bench.fem.newton import Springs, minimise
from organphys_bench.fem.organ_mesh import OrganMesh


def cube(cells=3):
    """A unit cube of ``cells``^3 cubes, six tetrahedra each."""
    axis = np.linspace(0, 1, cells + 1)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape(cells + 1, cells + 1, cells + 1)
    tetrahedra = []
    for steps in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        corner, path = np.zeros(3, int), []
        for step in (None, *steps):
            if step is not None:
                corner = corner + np.eye(3, dtype=int)[step]
            window = tuple(slice(c, c + cells) for c in corner)
            path.append(number[window].ravel())
        tetrahedra.append(np.column_stack(path))
    cells_of = np.concatenate(tetrahedra)
    volumes = OrganMesh(nodes, cells_of).volumes
    return OrganMesh(nodes, np.where((volumes < 0)[:, None], cells_of[:, [0, 2, 1, 3]], cells_of))


@pytest.fixture(scope="module")
def elastic():
    mesh = cube()
    return Elasticity(Assembly.of(mesh), LogNeoHookean.from_youngs(1.0, 0.3), mesh.volumes)


def test_the_cube_is_filled_and_its_points_are_found(elastic):
    mesh = elastic.assembly.mesh
    assert mesh.volumes.min() > 0
    assert np.isclose(mesh.volumes.sum(), 1)
    points = np.random.default_rng(0).uniform(0, 1, (50, 3))
    carried = mesh.carry(points)
    assert carried.barycentric.min() > -1e-9
    assert np.allclose(mesh.moved(carried, mesh.nodes), points)


def test_gradient_and_hessian_are_derivatives(elastic):
    rng = np.random.default_rng(1)
    shape = elastic.assembly.mesh.nodes.shape
    u, way, step = 0.004 * rng.normal(size=shape), rng.normal(size=shape), 1e-6
    above, below = (elastic.energy_and_gradient(u + sign * step * way) for sign in (1, -1))
    assert np.isclose((above[0] - below[0]) / (2 * step), elastic.energy_and_gradient(u)[1] @ way.ravel(), rtol=1e-6)
    at_rest = elastic.assembly.matrix(elastic.hessian_entries(np.zeros(shape)))
    above, below = (elastic.energy_and_gradient(sign * step * way)[1] for sign in (1, -1))
    assert np.allclose((above - below) / (2 * step), at_rest @ way.ravel(), rtol=1e-5, atol=1e-6)
    assert abs(at_rest - at_rest.T).max() < 1e-12


def springs_to(elastic, targets, *, scale):
    mesh = elastic.assembly.mesh
    points = mesh.nodes
    metric = np.broadcast_to(np.eye(3) / len(points), (len(points), 3, 3))
    return Springs(mesh.carry(points), points, targets, metric, scale=scale)


def test_spring_matrix_is_the_hessian_of_the_springs(elastic):
    mesh = elastic.assembly.mesh
    springs = springs_to(elastic, mesh.nodes, scale=False)
    matrix = elastic.assembly.matrix(spring_entries(elastic.assembly, springs.carried, springs.metric))
    u = np.random.default_rng(2).normal(size=mesh.nodes.shape)
    assert np.isclose(0.5 * u.ravel() @ (matrix @ u.ravel()), (u**2).sum() / len(u))


def test_a_turned_and_enlarged_target_costs_no_energy(elastic):
    mesh, turn = elastic.assembly.mesh, rotation_about(np.array([0.0, 0.3, 1.0]), 0.5)
    targets = 1.25 * (mesh.nodes @ turn.T + np.array([0.1, -0.2, 0.3]))
    springs, u = springs_to(elastic, targets, scale=True), np.zeros_like(mesh.nodes)
    u, gamma, steps = minimise(elastic, 0.1, springs, u, 1.0, steps=60, tolerance=1e-14)
    assert steps < 60
    assert np.isclose(gamma, 1 / 1.25, rtol=1e-3)
    assert elastic.energy_and_gradient(u)[0] < 1e-6
    _, kept, _ = minimise(elastic, 0.1, springs_to(elastic, targets, scale=False), u, 1.0, steps=20, tolerance=1e-14)
    assert kept == 1.0


def test_the_stiffer_organ_bends_less(elastic):
    mesh = elastic.assembly.mesh
    targets = mesh.nodes + np.column_stack([np.zeros((len(mesh.nodes), 2)), 0.3 * mesh.nodes[:, 0] ** 2])
    left = []
    for alpha in (1.0, 0.01):
        start = np.zeros_like(mesh.nodes)
        u, _, _ = minimise(
            elastic, alpha, springs_to(elastic, targets, scale=False), start, 1.0, steps=40, tolerance=1e-12
        )
        left.append(np.linalg.norm(mesh.nodes + u - targets, axis=1).mean())
        assert np.linalg.det(mesh.gradients(u)).min() > 0
    assert left[1] < 0.3 * left[0]


def test_the_papers_elastic_icp_comes_to_rest_on_its_target():
    from organphys.elastic.paper_model import PaperElasticOptions
    from organphys_bench.fem.elastic_icp import paper_elastic_icp

    mesh = cube(2)
    elastic = Elasticity(Assembly.of(mesh), LogNeoHookean.from_youngs(1e-3, 0.3), mesh.volumes)
    shifted = mesh.nodes + np.array([0.03, 0.02, -0.02])
    u, facts = paper_elastic_icp(mesh, elastic, mesh.nodes, shifted, PaperElasticOptions(inner_steps=20))
    assert np.abs(mesh.nodes + u - shifted).max() < 1e-3
    assert facts["outer_steps"] < 50
    assert [row[0] for row in facts["alpha_trim30_drift"]] == sorted(
        (row[0] for row in facts["alpha_trim30_drift"]), reverse=True
    )


def test_deformed_normals_follow_a_turn():
    from organphys.ground.frames import Normalisation, Similarity
    from organphys.points.surface_samples import SurfaceSamples
    from organphys_bench.fem.elastic_icp import FemOrgan

    mesh, turn = cube(2), rotation_about(np.array([1.0, 2.0, 0.0]), 0.7)
    normals = np.tile(np.array([0.0, 0.0, 1.0]), (5, 1))
    points = np.column_stack([np.random.default_rng(3).uniform(0, 1, (5, 2)), np.ones(5)])
    organ = FemOrgan.of(mesh, SurfaceSamples(points, normals, 0.1, Normalisation(np.zeros(3), 1.0)))
    shape = organ.deformed(mesh.nodes @ turn.T - mesh.nodes, 1.0, Similarity.identity())
    assert np.allclose(shape.normals, normals @ turn.T)
    assert np.allclose(shape.points, points @ turn.T)
