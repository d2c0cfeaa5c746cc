"""The paper's elastic stage: objective, known deformation, and the paper's finding on a partial target."""

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial import cKDTree

from organphys.elastic.paper_elastic import paper_elastic
from organphys.elastic.paper_model import PaperElasticOptions, paper_model
from organphys.elastic.paper_objective import PaperObjective, correspondences
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity, rotation_about
from organphys.ground.progress import Cancelled
from organphys.ground.solve_report import Stop
from organphys.mechanics.lbfgs import minimise
from organphys.mechanics.newton import newton

SPACING = 4.0
POSE = Similarity(0.02, rotation_about(np.array([1.0, 1.0, 0.3]), 0.8), np.array([0.5, -0.3, 4.0]))


def voxels():
    """Voxel centres V (N, 3) of an ellipsoid 120 x 72 x 48 mm and which of them lie on its boundary."""
    axis = np.arange(-64, 65, SPACING)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    inside = grid[((grid / [60, 36, 24]) ** 2).sum(1) < 1]
    neighbours = cKDTree(inside).query_ball_point(inside, 1.01 * SPACING, return_length=True)
    return inside + np.array([10.0, 20, 30]), neighbours < 7


def bend(points):
    """A smooth, volume-preserving deformation of up to 8 mm: a shear that grows with x^2."""
    out = points.copy()
    out[:, 2] += 8 * ((points[:, 0] - 10) / 60) ** 2
    return out


@pytest.fixture(scope="module")
def organ():
    inside, boundary = voxels()
    return inside, boundary, len(inside) * SPACING**3 / 1000


def options(**changes):
    return PaperElasticOptions(
        **{"handles": 8, "quadrature": 500, "outer_steps": 8, "stiffness": "aggressive", **changes}
    )


def model_of(organ, **changes):
    return paper_model(organ[0][organ[1]], organ[0], organ[2], options=options(**changes))


@pytest.fixture(scope="module")
def model(organ):
    return model_of(organ)


def test_normalisation_and_quadrature_are_the_stated_ones(organ, model):
    surface = organ[0][organ[1]]
    assert np.abs(model.surface).max() == pytest.approx(1.0)
    np.testing.assert_allclose(model.normalisation.centre, surface.mean(0))
    assert model.elasticity.weights.sum() == pytest.approx(organ[2] * 1000 / model.normalisation.length**3)
    assert model.basis.size == 32 and model.surface_phi.shape == (len(surface), 32)


def test_objective_and_gradient(model):
    """Against the plain sum of equation 4, and by finite differences."""
    rng, alpha = np.random.default_rng(0), 0.02
    z = 0.01 * rng.normal(size=(model.basis.size, 3))
    matched, w = rng.normal(size=model.surface.shape), rng.uniform(size=len(model.surface))
    objective = PaperObjective.at(alpha, model.elasticity, model.surface_phi, model.surface, matched, w)
    energy, gradient = objective(z.ravel())
    moved = model.surface + model.surface_phi @ z
    expected = alpha * model.elasticity.energy(z) + (w * ((moved - matched) ** 2).sum(1)).sum()
    assert energy == pytest.approx(expected, rel=1e-12)
    for _ in range(4):
        d = rng.normal(size=z.size)
        slope = (objective(z.ravel() + 1e-6 * d)[0] - objective(z.ravel() - 1e-6 * d)[0]) / 2e-6
        assert gradient @ d == pytest.approx(slope, rel=1e-6)


def test_three_solvers_find_the_same_minimum(organ, model):
    """One sub-problem by L-BFGS-B, projected Newton and L-BFGS with a Cholesky factor of the Hessian at rest."""
    inside, boundary, _ = organ
    tree = cKDTree(model.normalisation.apply(bend(inside[boundary])))
    matched, w = correspondences(model.surface, tree, sigma=0.05, keep=1.0)
    objective = PaperObjective.at(0.05, model.elasticity, model.surface_phi, model.surface, matched, w)
    data = 2 * np.kron(objective.quadratic, np.eye(3))
    z0 = np.zeros((model.basis.size, 3))

    def hessian(flat):
        return 0.05 * model.elasticity.hessian(flat.reshape(-1, 3), project=True) + data

    by_newton, newton_report = newton(objective, hessian, z0.ravel(), steps=40, tolerance=1e-12)
    factor = cho_factor(0.05 * model.elasticity.rest_hessian() + data + 1e-9 * np.trace(data) * np.eye(len(data)))
    by_lbfgs, report = minimise(
        objective, z0.ravel(), precondition=lambda g: cho_solve(factor, g), steps=100, tolerance=1e-12
    )
    by_scipy, _ = objective.minimise(z0, steps=3000, gradient_tolerance=1e-8)
    best = objective(by_newton)[0]
    assert newton_report.stop is Stop.CONVERGED and report.stop is Stop.CONVERGED and report.iterations < 60
    assert objective(by_lbfgs)[0] == pytest.approx(best, rel=1e-6)
    assert objective(by_scipy.ravel())[0] == pytest.approx(best, rel=1e-3)


def test_correspondence_weights():
    tree = cKDTree(np.zeros((1, 3)))
    points = np.array([[0.0, 0, 0], [0.05, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
    matched, weights = correspondences(points, tree, sigma=0.05, keep=1.0)
    np.testing.assert_allclose(weights, np.exp([0, -0.5, -2.0, -8.0]), rtol=1e-12)
    np.testing.assert_array_equal(matched, 0)
    np.testing.assert_allclose(correspondences(points, tree, sigma=0.05, keep=0.5)[1][2:], 0)


def test_elastic_recovers_a_known_deformation_better_than_the_rigid_pose(organ, model):
    inside, boundary, _ = organ
    target = POSE.apply(bend(inside[boundary]))
    result = paper_elastic(model, target, T_scene_ct=POSE, options=options())
    truth = POSE.apply(bend(inside))

    def error(mapped):
        return np.linalg.norm(mapped - truth, axis=1).mean() / POSE.scale

    assert error(result.map_points(inside)) < 0.5 * error(POSE.apply(inside))
    assert result.steps[-1].min_det_f > 0.5
    assert result.steps[-1].trim30_ct_to_splat_mm < 0.5 * result.steps[0].trim30_ct_to_splat_mm + 0.5


def test_nothing_happens_when_everything_matches(organ, model):
    inside, boundary, _ = organ
    result = paper_elastic(model, POSE.apply(inside[boundary]), T_scene_ct=POSE, options=options())
    assert np.abs(result.map_points(inside) - POSE.apply(inside)).max() / POSE.scale < 1e-3
    assert result.report.stop is Stop.CONVERGED and len(result.steps) == 3
    assert result.steps[-1].largest_move_mm < 1e-3


def test_residual_falls_with_alpha_while_volume_drift_grows(organ, model):
    """The paper's Figure 8 in kind: seen from one side, the organ is pulled towards its own visible half."""
    inside, boundary, _ = organ
    surface = bend(inside[boundary])
    target = POSE.apply(surface[surface[:, 2] > 31] + [0, 0, 1.5])
    steps = paper_elastic(model, target, T_scene_ct=POSE, options=options(outer_steps=12)).steps
    last = [[step for step in steps if step.alpha == alpha][-1] for alpha in (0.05, 0.025, 0.005)]
    residual = [step.trim30_splat_to_ct_mm for step in last]
    drift = [abs(step.volume_drift_percent) for step in last]
    assert residual[0] > residual[1] > residual[2]
    assert drift[0] < drift[1] < drift[2]


def test_presets_name_the_last_level():
    assert PaperElasticOptions(stiffness="conservative").alphas == (0.05,)
    assert PaperElasticOptions(stiffness="moderate").alphas == (0.05, 0.025)
    assert PaperElasticOptions(stiffness="aggressive").alphas == (0.05, 0.025, 0.005)
    for bad in ({"stiffness": "soft"}, {"weights": "other"}, {"keep": 0.0}):
        with pytest.raises(InputError):
            PaperElasticOptions(**bad)


def test_whitened_and_plain_coordinates_agree(organ, model):
    inside, boundary, _ = organ
    target = POSE.apply(bend(inside[boundary]))
    few = {"outer_steps": 3, "inner_steps": 400, "stiffness": "conservative"}
    plain = paper_elastic(model, target, T_scene_ct=POSE, options=options(**few))
    white = paper_elastic(model_of(organ, whiten=True), target, T_scene_ct=POSE, options=options(**few))
    gap = np.linalg.norm(plain.map_points(inside) - white.map_points(inside), axis=1) / POSE.scale
    assert gap.mean() < 0.05


def test_same_seed_same_result_and_unit_of_the_records(organ, model):
    inside, boundary, _ = organ
    target = POSE.apply(bend(inside[boundary]))
    short = options(outer_steps=2, stiffness="conservative")
    first = paper_elastic(model, target, T_scene_ct=POSE, options=short)
    second = paper_elastic(model_of(organ), target, T_scene_ct=POSE, options=short, mm_per_unit=100.0)
    np.testing.assert_array_equal(first.z, second.z)
    ratio = second.steps[-1].trim30_ct_to_splat_mm / first.steps[-1].trim30_ct_to_splat_mm
    assert ratio == pytest.approx(100.0 * POSE.scale)
    nearest = cKDTree(target).query(first.map_points(inside[boundary]))[0] / POSE.scale
    assert first.steps[-1].mean_ct_to_splat_mm == pytest.approx(nearest.mean(), rel=1e-9)


def test_learned_weights_are_interchangeable(organ):
    pytest.importorskip("torch")
    from organphys.basis.learned_training import TrainingOptions, train
    from organphys.basis.reduced_basis import ReducedBasis
    from organphys.basis.reduced_elasticity import ReducedElasticity
    from organphys.elastic.paper_model import PaperModel

    inside, boundary, _ = organ
    base = model_of(organ, handles=4)
    normalised = base.normalisation.apply(inside)
    basis = ReducedBasis.plain(train(normalised, TrainingOptions(handles=4, steps=60, layers=2, width=24)))
    elasticity = ReducedElasticity.at(basis, base.elasticity.points, base.elasticity.material)
    learned = PaperModel(base.normalisation, basis, elasticity, base.surface, basis.phi(base.surface))
    target, short = POSE.apply(bend(inside[boundary])), options(outer_steps=4, stiffness="conservative")
    result = paper_elastic(learned, target, T_scene_ct=POSE, options=short)
    assert result.steps[-1].mean_ct_to_splat_mm < 0.9 * np.linalg.norm(bend(inside) - inside, axis=1).mean()


def test_progress_and_cancel(model, organ):
    target, seen = POSE.apply(organ[0][organ[1]]), []
    paper_elastic(model, target, T_scene_ct=POSE, options=options(), progress=lambda *call: seen.append(call))
    assert {stage for stage, _ in seen} == {"elastic"} and seen[-1][1] == 1.0
    assert [fraction for _, fraction in seen] == sorted(fraction for _, fraction in seen)

    def cancel(stage, fraction):
        raise Cancelled

    with pytest.raises(Cancelled):
        paper_elastic(model, target, T_scene_ct=POSE, options=options(), progress=cancel)
