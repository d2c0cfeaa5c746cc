"""The parts of the elastic stage: derivatives by finite differences, visibility and rim on known shapes."""

from dataclasses import replace

import numpy as np
import pytest
from scene_examples import POSE, bumpy_organ, seen_from_camera
from scipy.spatial import cKDTree

from organphys.align.poses import Poses
from organphys.align.rim import Rim
from organphys.elastic import load_prior
from organphys.elastic.data_terms import DataOptions, organ_matches, precision, rim_matches, splat_matches
from organphys.elastic.elastic_registration import ElasticState, find_matches
from organphys.elastic.joint_scale import ScalePrior, data_quadratic, solve
from organphys.elastic.load_prior import load_hessian
from organphys.elastic.matches import Deformed, Matches, geman_mcclure
from organphys.elastic.mode_choice import ElasticScore, Modes, choose_mode, elastic_score
from organphys.elastic.reduced_organ import ReducedOrganOptions, reduce_organ
from organphys.elastic.visibility import visibility
from organphys.ground.frames import Similarity, fit_similarity, rotation_about
from organphys.pipeline.default_stages import mode_metrics, mode_notices
from organphys.points.sampling import random_subset
from organphys.points.surface_samples import sample_surface

OPTIONS = ReducedOrganOptions(handles=6, nodes=150, basis_samples=1500, quadrature=600)


@pytest.fixture(scope="module")
def setting():
    """Reduced organ, view and the true pose T_camera_normalised of a rigid copy."""
    record = bumpy_organ()
    samples = sample_surface(record, count=2500)
    view = seen_from_camera(record).view()
    return reduce_organ(record, samples, options=OPTIONS), view, POSE @ samples.normalisation.T_ct_normalised


@pytest.fixture(scope="module")
def bent(setting):
    """Coordinates Z (4H, 3) of a visible bend together with a rotation by 35 degrees."""
    organ = setting[0]
    x = organ.elasticity.points
    bend = 0.2 * np.stack([-x[:, 2] * x[:, 0], np.sin(2 * x[:, 0]), x[:, 0] ** 2], axis=1)
    z = np.linalg.lstsq(organ.basis.phi(x), bend, rcond=None)[0]
    turn = rotation_about(np.array([1.0, 0.3, -0.2]), np.radians(35))
    z = z @ turn.T + organ.basis.similarity_coordinates(turn - np.eye(3), np.array([0.1, 0.2, -0.1]))
    assert organ.elasticity.min_det(z) > 0.2
    return z


def matches_of(organ, count=200, seed=0):
    rng = np.random.default_rng(seed)
    rows = rng.choice(len(organ.samples.points), count)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    targets = organ.samples.points[rows] + 0.2 * rng.normal(size=(count, 3))
    return Matches(rows, targets, rng.uniform(0, 0.02, count), normals, rng.uniform(0, 1, count))


def true_cost(organ, matches, z, gamma):
    """sum w ((1 - p) |r|^2 + p (n r)^2) of r = x - gamma a, match by match."""
    total = 0.0
    for row, target, weight, normal, plane in zip(
        matches.rows, matches.targets, matches.weights, matches.normals, matches.plane, strict=True
    ):
        r = organ.samples.points[row] + organ.phi[row] @ z - gamma * target
        total += weight * ((1 - plane) * (r @ r) + plane * (normal @ r) ** 2)
    return total


def tangents(normals):
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(1)])
    return first, np.cross(normals, first)


def mapped_normals(organ, z, step=1e-5):
    """Normals of the mapped surface by finite differences of the map along two tangents."""
    points, normals = organ.samples.points, organ.samples.normals

    def along(t):
        return 2 * step * t + (organ.basis.phi(points + step * t) - organ.basis.phi(points - step * t)) @ z

    normal = np.cross(*(along(t) for t in tangents(normals)))
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def test_normals_of_a_large_rotation(setting):
    organ = setting[0]
    turn = rotation_about(np.array([0.2, -1.0, 0.4]), 2.5)
    z = organ.basis.similarity_coordinates(1.7 * turn - np.eye(3), np.ones(3))
    np.testing.assert_allclose(organ.normals(z), organ.samples.normals @ turn.T, atol=1e-9)
    np.testing.assert_allclose(organ.points(z), 1.7 * organ.samples.points @ turn.T + 1, atol=1e-9)


def test_normals_of_a_bend(setting, bent):
    organ = setting[0]
    np.testing.assert_allclose(organ.normals(bent), mapped_normals(organ, bent), atol=1e-6)
    assert np.abs(organ.normals(bent) - organ.samples.normals).max() > 0.2


def test_metric_is_the_stated_one(setting):
    matches = matches_of(setting[0], 30)
    r = np.random.default_rng(1).normal(size=(30, 3))
    got = (r * (matches.metric() @ r[..., None])[..., 0]).sum(1)
    along = (matches.normals * r).sum(1) ** 2
    np.testing.assert_allclose(got, matches.weights * ((1 - matches.plane) * (r * r).sum(1) + matches.plane * along))


def test_joined_matches_keep_their_order(setting):
    first, second = matches_of(setting[0], 5), matches_of(setting[0], 7, seed=1)
    joined = Matches.join([first, second])
    np.testing.assert_array_equal(joined.rows, np.concatenate([first.rows, second.rows]))
    np.testing.assert_array_equal(joined.plane[5:], second.plane)


def test_geman_mcclure_is_the_slope_of_its_cost():
    e, tau, h = np.linspace(0, 0.3, 7), 0.2, 1e-7

    def cost(e):
        return e / (1 + e / tau**2)

    np.testing.assert_allclose(geman_mcclure(e, tau), (cost(e + h) - cost(e - h)) / (2 * h), rtol=1e-6)


def test_quadratic_is_the_data_cost(setting, bent):
    """Gradient and curvature against finite differences of the plain sum; the debiasing adds -2 D / gamma alone."""
    organ, matches, gamma = setting[0], matches_of(setting[0]), 1.07
    quadratic = data_quadratic(organ, matches, organ.points(bent), gamma, ScalePrior())
    q = np.append(bent.ravel(), gamma)

    def cost(q):
        return true_cost(organ, matches, q[:-1].reshape(-1, 3), q[-1])

    gradient = quadratic.value_and_gradient(q)[1]
    gradient[-1] += 2 * cost(q) / gamma
    rng, h = np.random.default_rng(0), 1e-4
    directions = [*rng.normal(size=(6, len(q))), np.eye(len(q))[-1]]
    for d in directions:
        assert gradient @ d == pytest.approx((cost(q + h * d) - cost(q - h * d)) / (2 * h), rel=1e-6)
        second = (cost(q + h * d) - 2 * cost(q) + cost(q - h * d)) / h**2
        assert d @ quadratic.hessian @ d == pytest.approx(second, rel=1e-4)
    p = rng.normal(size=len(q))
    value, slope = quadratic.value_and_gradient(p)
    assert slope @ q == pytest.approx(
        (quadratic.value_and_gradient(p + h * q)[0] - quadratic.value_and_gradient(p - h * q)[0]) / (2 * h), rel=1e-6
    )
    assert np.isfinite(value)


def test_debiased_slope_is_that_of_scene_units(setting, bent):
    """D / gamma^2, the data in scene units, has the slope gamma^-2 times the debiased one."""
    organ, matches, gamma, h = setting[0], matches_of(setting[0]), 0.9, 1e-5
    quadratic = data_quadratic(organ, matches, organ.points(bent), gamma, ScalePrior())
    slope = quadratic.value_and_gradient(np.append(bent.ravel(), gamma))[1][-1]

    def scene_cost(gamma):
        return true_cost(organ, matches, bent, gamma) / gamma**2

    expected = (scene_cost(gamma + h) - scene_cost(gamma - h)) / (2 * h)
    assert slope / gamma**2 == pytest.approx(expected, rel=1e-5)


def test_scale_prior_is_a_parabola(setting, bent):
    organ, matches = setting[0], matches_of(setting[0])
    without = data_quadratic(organ, matches, organ.points(bent), 1.0, ScalePrior())
    prior = data_quadratic(organ, matches, organ.points(bent), 1.0, ScalePrior(1.2, 3.0))
    values = []
    for gamma in (1.0, 1.2, 1.3):
        q = np.append(bent.ravel(), gamma)
        values.append(prior.value_and_gradient(q)[0] - without.value_and_gradient(q)[0])
    assert values[0] - values[1] == pytest.approx(3.0 * 0.2**2)
    assert values[2] - values[1] == pytest.approx(3.0 * 0.1**2)


def test_scale_prior_of_a_unit():
    assert ScalePrior.of(1.1, 0.0).weight == np.inf
    assert ScalePrior.of(1.1, 2.0).weight == pytest.approx(0.018)
    assert ScalePrior.of(1.1, 4.0).weight == pytest.approx(0.018 / 4)


def solved(setting, prior, steps=40):
    organ, view, truth = setting
    state = ElasticState(np.zeros((organ.basis.size, 3)), 1.0, truth)
    chosen = random_subset(len(organ.samples.points), 2200, 0)
    shape = state.deformed(organ)
    matches = find_matches(organ, shape, view, chosen, 0.15, DataOptions())
    data = data_quadratic(organ, matches, shape.points, 1.0, prior)
    return solve(organ, data, 0.1, 0.0, state.z, 1.0, steps=steps)


def test_exact_prior_pins_gamma(setting):
    assert solved(setting, ScalePrior(0.93, np.inf))[1] == pytest.approx(0.93, abs=1e-5)
    assert abs(solved(setting, ScalePrior())[1] - 0.93) > 0.02
    soft = solved(setting, ScalePrior.of(0.93, 2.0))[1]
    assert 0.931 < soft < solved(setting, ScalePrior())[1]


@pytest.mark.parametrize("loads", [0.0, 0.8])
def test_solve_ends_in_the_minimum(setting, bent, loads):
    """The sum of prior and data is flat there, to a thousandth of its slopes at the bent start."""
    organ, matches, alpha = setting[0], matches_of(setting[0]), 0.1
    data = data_quadratic(organ, matches, organ.points(bent), 1.0, ScalePrior(1.0, 0.5))
    held = load_hessian(organ, bent)

    def slope(z, gamma, d, h=1e-5):
        def value(q):
            prior = (1 - loads) * organ.elasticity.energy(q[:-1].reshape(-1, 3)) + loads * 0.5 * q[:-1] @ held @ q[:-1]
            return alpha * prior + data.value_and_gradient(q)[0]

        q = np.append(z.ravel(), gamma)
        return (value(q + h * d) - value(q - h * d)) / (2 * h)

    z, gamma, spent = solve(organ, data, alpha, loads, bent, 1.0, steps=80)
    assert 0 < spent < 200 and organ.elasticity.min_det(z) > 0
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(20, z.size + 1))
    before = np.abs([slope(bent, 1.0, d) for d in directions]).max()
    assert np.abs([slope(z, gamma, d) for d in directions]).max() < 1e-3 * before


def test_load_prior_is_the_mean_square_load(setting, bent, monkeypatch):
    """With equal weights: f = Phi K Z, its mean square by the plain sum; rigid motions cost nothing."""
    monkeypatch.setattr(load_prior, "TAIL", 0.0)
    organ = setting[0]
    stiffness, modes = np.linalg.eigh(organ.rest_hessian)
    loads = organ.phi_volume @ (organ.rest_hessian @ bent.ravel()).reshape(-1, 3)
    found = load_hessian(organ, bent)
    assert bent.ravel() @ found @ bent.ravel() * organ.load_unit == pytest.approx((loads**2).sum(1).mean())
    costs = np.diag(modes.T @ found @ modes)
    np.testing.assert_allclose(costs, stiffness**2 / organ.load_unit, atol=1e-8 * costs.max())
    assert np.abs(costs[:6]).max() < 1e-8 * costs[20] and organ.load_unit == pytest.approx(stiffness[12])


def test_load_prior_forgives_a_patch_of_strong_load(setting):
    """Of two loads with the same mean square the one that acts on a tenth of the volume costs less."""
    even = np.ones((500, 3))
    patch = np.full((500, 3), 0.1)
    patch[:50] = np.sqrt((500 - 450 * 0.01) / 50)
    costs = [float((load_prior._weights(f) * (f**2).sum(1)).mean()) for f in (even, patch)]
    assert costs[0] == pytest.approx(3.0) and costs[1] < 0.5 * costs[0]
    assert load_prior._weights(patch).mean() == pytest.approx(1.0)


def test_state_without_rigid_part_maps_the_same(setting, bent):
    organ, _, truth = setting
    state = ElasticState(bent, 1.08, truth)
    free = state.without_rigid_part(organ)
    before, after = state.pose.apply(organ.points(state.z)), free.pose.apply(organ.points(free.z))
    np.testing.assert_allclose(after, before, atol=1e-10)
    assert free.gamma == 1.0 and free.pose.scale == pytest.approx(truth.scale / 1.08)
    rest = organ.elasticity.points
    left = fit_similarity(rest, rest + organ.basis.phi(rest) @ free.z, scale=False)
    np.testing.assert_allclose(left.matrix, np.eye(4), atol=1e-9)
    assert np.abs(fit_similarity(rest, rest + organ.basis.phi(rest) @ bent, scale=False).matrix - np.eye(4)).max() > 0.3
    assert organ.elasticity.energy(free.z) == pytest.approx(organ.elasticity.energy(bent))


def test_target_frame_undoes_the_start(setting):
    _, _, truth = setting
    shape = Deformed(np.zeros((1, 3)), np.zeros((1, 3)), 1.25, truth)
    x = np.random.default_rng(0).normal(size=(5, 3))
    np.testing.assert_allclose(shape.target_frame(truth.apply(x)), x, atol=1e-9)
    # x = gamma a is where the pose in force puts the scene point
    np.testing.assert_allclose(shape.pose.apply(1.25 * shape.target_frame(truth.apply(x))), truth.apply(x), atol=1e-9)


def state_of(setting, **changes):
    organ, _, truth = setting
    return replace(ElasticState(np.zeros((organ.basis.size, 3)), 1.0, truth), **changes).deformed(organ)


def test_visibility_of_a_rigid_copy(setting):
    """Front: exactly the samples near a seen point; the organ's back is neither front nor unknown nor empty."""
    organ, view, truth = setting
    seen = visibility(state_of(setting), view, 0.1)
    to_camera = -truth.apply(organ.samples.points)
    to_camera /= np.linalg.norm(to_camera, axis=1, keepdims=True)
    facing = (truth.turn(organ.samples.normals) * to_camera).sum(1)
    np.testing.assert_allclose(seen.facing, facing, atol=1e-9)
    distance = view.tree.query(truth.apply(organ.samples.points))[0] / truth.scale
    assert seen.front[(facing > 0.3) & (distance < 0.04)].mean() > 0.98
    assert not seen.front[facing < 0.1].any()
    assert distance[seen.front].max() < 0.3
    assert np.abs(seen.before[seen.front & (facing > 0.5)]).mean() < 0.04
    assert seen.empty.mean() < 0.03 and seen.beside[~seen.empty & ~seen.unknown].max() == 0


def test_visibility_of_a_shifted_copy(setting):
    """Towards the camera: all before the surface by the shift; sideways: some in the empty, beside by the shift."""
    _, view, truth = setting
    ray = view.surface.centre / np.linalg.norm(view.surface.centre)
    nearer = Similarity(truth.scale, truth.rotation, truth.translation - 0.2 * truth.scale * ray)
    seen = visibility(state_of(setting, start=nearer), view, 0.1)
    assert np.median(seen.before[seen.front & (seen.facing > 0.6)]) == pytest.approx(0.2, abs=0.03)
    farther = Similarity(truth.scale, truth.rotation, truth.translation + 0.3 * truth.scale * ray)
    assert visibility(state_of(setting, start=farther), view, 0.1).front.mean() < 0.1  # beyond 1.5 tau: hidden
    beside = Similarity(truth.scale, truth.rotation, truth.translation + np.array([0.3 * truth.scale, 0, 0]))
    seen = visibility(state_of(setting, start=beside), view, 0.1)
    assert seen.empty.mean() > 0.05
    assert 0.2 < seen.beside[seen.empty].max() < 0.45
    points = seen.points[seen.empty]
    to_mask = cKDTree(view.image.centre(np.argwhere(view.image.mask))).query(points[:, :2] / points[:, 2:])[0]
    expected = to_mask * points[:, 2] / truth.scale
    np.testing.assert_allclose(seen.beside[seen.empty], expected, atol=1.5 * view.image.pixel * 6 / truth.scale)


def test_splat_matches_pull_to_the_splat(setting):
    """At the truth the residuals are noise; all weights sum to the term's weight."""
    organ, view, _ = setting
    shape = state_of(setting)
    matches = splat_matches(shape, view, 0.15, DataOptions(splat_weight=2.0))
    residual = organ.samples.points[matches.rows] - matches.targets
    assert np.abs((residual * matches.normals).sum(1)).mean() < 0.02
    assert 1.5 < matches.weights.sum() <= 2.0
    assert (matches.plane == 0.9).all()
    # gamma scales what the targets are compared with
    scaled = splat_matches(replace(shape, gamma=2.0), view, 0.15, DataOptions())
    assert scaled.weights.sum() < 0.5 * matches.weights.sum()


def test_organ_matches_are_visible_samples_at_their_splat_points(setting):
    organ, view, truth = setting
    shape = state_of(setting)
    seen = visibility(shape, view, 0.15)
    chosen = np.arange(0, len(organ.samples.points), 2)
    matches = organ_matches(shape, view, seen, chosen, 0.15, DataOptions())
    assert set(matches.rows) <= set(chosen[seen.front[chosen]])
    target = truth.apply(matches.targets)
    np.testing.assert_allclose(view.tree.query(target)[0], 0, atol=1e-9)
    assert 0.3 < matches.weights.sum() <= 1.0
    few = organ_matches(shape, view, seen, chosen[:30], 0.15, DataOptions())
    assert len(few.rows) == 0


def shrunk(setting, factor):
    """The organ scaled by ``factor`` about its visible middle's centre, as an elastic state."""
    organ = setting[0]
    return state_of(setting, z=organ.basis.similarity_coordinates((factor - 1) * np.eye(3), np.zeros(3)))


def test_grazing_surfaces_are_placed_more_exactly():
    points, angles = np.array([[0.0, 0, 5.0]] * 3), np.radians([0, 60, 90])
    normals = np.stack([np.sin(angles), 0 * angles, -np.cos(angles)], axis=1)
    found = precision(points, normals, 0.25)
    expected = 1 / (np.cos(angles) ** 2 + (0.25 * np.sin(angles)) ** 2)
    np.testing.assert_allclose(found, expected / expected.mean())
    np.testing.assert_allclose(precision(points, normals, 1.0), 1)
    assert len(precision(points[:0], normals[:0], 0.25)) == 0


def rim_force(setting, factor):
    """Weighted mean step along the outward rim normal that the rim term asks for, and its matches."""
    organ, view, _ = setting
    shape = shrunk(setting, factor)
    matches = rim_matches(shape, view, visibility(shape, view, 0.15), organ.samples.spacing, 0.15, DataOptions())
    step = ((matches.targets - shape.points[matches.rows]) * matches.normals).sum(1)
    return float((matches.weights * step).sum() / matches.weights.sum()), matches


def test_rim_pulls_a_shrunken_organ_outwards(setting):
    outwards, matches = rim_force(setting, 0.93)
    assert outwards > 0.03 and len(matches.rows) > 50
    assert rim_force(setting, 1.07)[0] < -0.03
    assert abs(rim_force(setting, 1.0)[0]) < 0.03
    assert (matches.plane == 1.0).all() and matches.weights.sum() <= DataOptions().rim_weight


def test_rim_planes_hold_camera_and_tangent(setting):
    _, view, truth = setting
    _, matches = rim_force(setting, 0.97)
    normals = truth.turn(matches.normals)
    target = truth.apply(matches.targets)
    np.testing.assert_allclose((normals * target).sum(1), 0, atol=1e-9)
    on_plane = target[:, :2] / target[:, 2:]
    gap = np.linalg.norm(on_plane[:, None] - view.rim.points[None], axis=2)
    assert gap.min(1).max() < 1e-9
    across = normals[:, :2] / np.linalg.norm(normals[:, :2], axis=1, keepdims=True)
    assert (across * view.rim.normals[gap.argmin(1)]).sum(1).min() > 1 - 1e-6


def test_a_short_rim_says_nothing(setting):
    view = setting[1]
    short = replace(view, rim=Rim(view.rim.points[:10], view.rim.normals[:10]))
    shape = shrunk(setting, 1.0)
    assert len(rim_matches(shape, short, visibility(shape, view, 0.1), 0.05, 0.1, DataOptions()).rows) == 0
    away = replace(view, rim=Rim(view.rim.points + 50.0, view.rim.normals))
    assert len(rim_matches(shape, away, visibility(shape, view, 0.1), 0.05, 0.1, DataOptions()).rows) == 0


def test_elastic_score_knows_the_truth_and_the_price_of_bending(setting, bent):
    organ, view, truth = setting
    rest = ElasticState(np.zeros_like(bent), 1.0, truth)
    right = elastic_score(organ, view, rest)
    assert right.total < 0.35 and right.energy == pytest.approx(0, abs=1e-12) and right.landmarks == 0
    turned = truth @ Similarity(1.0, rotation_about(np.array([0.0, 0, 1]), np.pi), np.zeros(3))
    wrong = elastic_score(organ, view, replace(rest, start=turned))
    assert wrong.splat + wrong.camera > 0.5
    assert elastic_score(organ, view, replace(rest, z=bent)).energy == pytest.approx(
        organ.elasticity.energy(bent) / 0.05
    )


def test_modes_are_ranked_by_the_elastic_fit(setting):
    organ, view, truth = setting
    turned = truth @ Similarity(1.0, rotation_about(np.array([0.0, 0, 1]), np.pi), np.zeros(3))
    tipped = truth @ Similarity(1.0, rotation_about(np.array([0.0, 1, 0]), 0.05), np.zeros(3))
    modes = choose_mode(organ, view, Poses.of([turned, truth, tipped]))
    totals = [score.total for score in modes.scores]
    assert totals == sorted(totals)
    np.testing.assert_array_equal(modes.poses.at(2).rotation, turned.rotation)
    assert np.array_equal(modes.best.rotation, modes.poses.rotation[0])
    runner_up = modes.runner_up(organ)  # tipped bends back to the truth: it is not another answer
    assert runner_up is not None and runner_up.score is modes.scores[2]
    assert runner_up.degrees == pytest.approx(180, abs=1) and runner_up.distance > 0.15


def test_two_poses_that_fit_alike_are_told_with_their_difference(setting):
    organ, _, truth = setting
    turned = truth @ Similarity(1.0, rotation_about(np.array([0.0, 0, 1]), np.pi / 3), np.zeros(3))
    good, bad = ElasticScore(0.2, 0.1, 0.1, 0.0), ElasticScore(0.21, 0.1, 0.1, 0.0)
    states = tuple(ElasticState(np.zeros((organ.basis.size, 3)), 1.0, pose) for pose in (truth, turned))
    modes = Modes(Poses.of([truth, turned]), (good, bad), states)
    (notice,) = mode_notices(modes, organ, None)
    metrics = mode_metrics(modes, organ)
    away = metrics["runner_up_distance"]["value"]
    assert metrics["runner_up_rotation"]["value"] == pytest.approx(60) and 10 < away < 100
    assert metrics["runner_up_score"] == {"value": pytest.approx(0.41), "unit": "1"}
    assert notice.code == "twist_ambiguous"
    for part in ("0.41 against 0.40", "60 degrees", f"{away:.0f} mm", "landmark"):
        assert part in notice.message
    far = Modes(modes.poses, (good, ElasticScore(0.4, 0.2, 0.1, 0.0)), states)
    assert mode_notices(far, organ, None) == []
