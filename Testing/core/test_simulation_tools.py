"""Parts of contact on their own: tool shapes, barrier, friction, grip springs, sub-steps, the path check."""

import numpy as np
import pytest
from simulation_examples import TISSUE, box_surface

from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from organphys.simulation.barrier import barrier
from organphys.simulation.continuous_check import crossed, substeps, substeps_at
from organphys.simulation.crushed_tissue import CRUSHED, simulated_material
from organphys.simulation.friction import friction, held_back
from organphys.simulation.grasp import between_jaws, grip_value
from organphys.simulation.state import ToolPose
from organphys.simulation.tool_force import low_pass
from organphys.simulation.tool_shapes import Capsule, sphere, surface_shape
from organphys.simulation.tools import Jaws, between, checked_pose, gripper, place, probe

CAPSULE = Capsule([0, 0, 0], [0.01, 0.02, 0], 0.003)
POSE = ToolPose(np.array([0.1, -0.2, 0.3]), rotation_about(np.array([1.0, 2, 3]), 0.7), 30.0)


def points(count: int = 50, scale: float = 0.02) -> np.ndarray:
    return np.random.default_rng(0).normal(size=(count, 3)) * scale


def slopes(function, x, step=1e-7):
    """Central differences (N, ..., 3) of function (N, 3) -> (N, ...)."""
    moves = step * np.eye(3)
    return np.stack([(function(x + m) - function(x - m)) / (2 * step) for m in moves], axis=-1)


def test_gap_of_a_capsule_its_normal_and_its_bend():
    x = points()
    gap, normal = CAPSULE.gap_and_normal(x)
    along = np.linspace(0, 1, 2001)[:, None] * CAPSULE.end
    brute = np.sqrt(((x[:, None] - along) ** 2).sum(2)).min(1) - CAPSULE.radius
    assert np.allclose(gap, brute, atol=1e-6)
    assert np.allclose(normal, slopes(lambda p: CAPSULE.gap_and_normal(p)[0], x), atol=1e-6)
    bend = CAPSULE.bend(x)
    assert np.abs(bend - slopes(lambda p: CAPSULE.gap_and_normal(p)[1], x)).max() < 1e-4 * np.abs(bend).max()


def test_a_surface_becomes_a_shape_with_the_distance_of_its_solid():
    size = np.array([0.010, 0.008, 0.006])
    vertices, faces = box_surface(size, 0.002)
    shape = surface_shape(vertices - size / 2, faces, 0.003)
    x = np.random.default_rng(1).uniform(-1, 1, (400, 3)) * (size / 2 + 0.001)
    gap, normal = shape.gap_and_normal(x)
    q = np.abs(x) - size / 2
    exact = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(1), 0)
    assert np.abs(gap - exact).max() < 2e-4
    sides = np.isclose(q.max(1), exact) & (np.sort(q, axis=1)[:, 1] < -0.001) & (q.max(1) > -0.0005)
    assert sides.sum() > 20
    straight = np.eye(3)[q.argmax(1)] * np.sign(x)
    assert (normal * straight).sum(1)[sides].min() > 0.99
    with pytest.raises(InputError, match="grid nodes"):
        surface_shape(vertices, faces, 0.003, spacing=1e-5)


def test_barrier_is_the_integral_of_its_force_and_twice_continuous():
    width, pressure = 1e-3, 5e4
    gap = np.linspace(-2e-3, 1.5e-3, 701)
    value, slope, curvature = barrier(gap, width, pressure)
    step = 1e-9
    higher, lower = barrier(gap + step, width, pressure), barrier(gap - step, width, pressure)
    assert np.allclose((higher[0] - lower[0]) / (2 * step), slope, atol=1e-5 * np.abs(slope).max())
    smooth = np.abs(gap - width) > 2 * step
    assert np.allclose(((higher[1] - lower[1]) / (2 * step))[smooth], curvature[smooth], rtol=1e-3, atol=10)
    assert (slope[gap < width] < 0).all() and (curvature >= 0).all()
    assert not value[gap >= width].any() and not slope[gap >= width].any()
    jump = np.diff(barrier(np.array([0.1 - 1e-9, 0.1 + 1e-9]) * width, width, pressure), axis=1)
    assert np.abs(jump[2]).max() < 1e-5 * curvature.max()


def test_friction_and_grip_are_gradients_of_their_energies():
    rng = np.random.default_rng(2)
    normal = rng.normal(size=(30, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    limit, slip = rng.uniform(1, 2, 30), rng.normal(size=(30, 3)) * np.geomspace(1e-5, 1e-2, 30)[:, None]
    one = slice(0, 1)

    def rubbed(k, s):
        return friction(s, normal[k : k + 1], limit[k : k + 1], 1e-3)

    def gripped(k, s):
        return grip_value(s, 1000 * limit[k : k + 1], limit[k : k + 1])

    for law in (rubbed, gripped):
        for k in range(30):
            at = law(k, slip[k : k + 1])
            step = 1e-5 * np.linalg.norm(slip[k])
            moves = step * np.eye(3)
            energy = [(law(k, slip[k] + m[None]).energy - law(k, slip[k] - m[None]).energy) / (2 * step) for m in moves]
            assert np.allclose(energy, at.gradient[0], atol=1e-5 * np.abs(at.gradient).max() + 1e-7)
            force = np.stack(
                [
                    (law(k, slip[k] + m[None]).gradient - law(k, slip[k] - m[None]).gradient)[one] / (2 * step)
                    for m in moves
                ],
                axis=-1,
            )[0]
            assert np.allclose(force, at.blocks[0], atol=1e-3 * np.abs(at.blocks).max())
            assert np.linalg.eigvalsh(at.blocks[0]).min() > -1e-9 * np.abs(at.blocks).max()
    fast = friction(normal[:, [1, 2, 0]] * 1.0, normal, limit, 1e-3)
    tangential = np.linalg.norm(fast.gradient, axis=1)
    assert np.allclose(tangential, limit)
    assert np.abs((fast.gradient * normal).sum(1)).max() < 1e-12


def test_grip_springs_never_pull_more_than_their_limit():
    offset = points(40, 0.05)
    force = np.linalg.norm(grip_value(offset, np.full(40, 100.0), np.full(40, 0.3)).gradient, axis=1)
    assert force.max() <= 0.3 * (1 + 1e-12) and np.isclose(force.max(), 0.3)


def test_parts_are_placed_where_the_pose_says():
    tool = gripper()
    parts = place(tool, POSE)
    tips = [part.to_scene(part.shape.end) for part in parts[:2]]
    closed = [part.to_scene(part.shape.end) for part in place(tool, ToolPose(POSE.position, POSE.rotation))[:2]]
    assert np.linalg.norm(tips[0] - tips[1]) > np.linalg.norm(closed[0] - closed[1]) + 0.003
    forward = POSE.position + POSE.rotation @ [0, 0, 0.005]
    assert between_jaws(forward[None], POSE, tool.jaws).all()
    away = np.array([[0, 0, -0.005], [0.006, 0, 0.005], [0, 0.009, 0.005], [0, 0, 0.014]])
    assert not between_jaws(away @ POSE.rotation.T + POSE.position, POSE, tool.jaws).any()
    x = points()
    part = parts[0]
    assert np.allclose(part.to_scene(part.to_local(x)), x)
    assert np.allclose(part.bend(x), part.bend(x).transpose(0, 2, 1))


def test_poses_in_between_and_bad_poses():
    end = ToolPose(np.zeros(3), np.eye(3), 10.0)
    middle = between(POSE, end, 0.5)
    assert np.allclose(middle.position, POSE.position / 2) and middle.jaw_deg == 20
    assert np.allclose(middle.rotation @ middle.rotation, POSE.rotation)
    assert between(POSE, end, 1.0) is end
    for bad in (
        ToolPose(np.array([np.nan, 0, 0])),
        ToolPose(np.zeros(3), np.diag([1.0, 1, -1])),
        ToolPose(np.zeros(3), np.eye(3), float("nan")),
    ):
        with pytest.raises(InputError, match="probe"):
            checked_pose(bad, "pose of probe")
    with pytest.raises(InputError, match="open_deg"):
        Jaws(close_deg=20, open_deg=10)


def test_a_fast_tool_is_cut_into_steps_smaller_than_its_radius():
    tool = probe(0.0025)
    assert substeps(tool, ToolPose(np.zeros(3)), ToolPose(np.array([0.001, 0, 0]))) == 1
    assert substeps(tool, ToolPose(np.zeros(3)), ToolPose(np.array([0.2 / 60, 0, 0]))) == 2
    turned = ToolPose(np.zeros(3), rotation_about(np.array([1.0, 0, 0]), 0.1))
    assert substeps(tool, ToolPose(np.zeros(3)), turned) == int(np.ceil(0.1 * tool.extent / 0.002))


def test_a_path_through_a_tool_is_seen_and_one_past_it_is_not():
    (part,) = place(probe(0.0025), ToolPose(np.zeros(3)))
    start, through = np.array([[0.004, 0, -0.01]]), np.array([[-0.004, 0.0001, -0.01]])
    assert crossed(part, part, start, through)
    assert not crossed(part, part, start, start + 0.002)
    assert not crossed(part, part, start, np.array([[-0.004, 0, 0.05]]))  # over the tip
    (moved,) = place(probe(0.0025), ToolPose(np.array([0.008, 0, 0])))
    assert crossed(part, moved, start, start)
    ball = place(probe(0.0025), POSE)[0]._replace(shape=sphere(0.001))
    assert ball.gap_and_normal(POSE.position[None] + [[0.003, 0, 0]])[0][0] == pytest.approx(0.002)


def test_low_pass_keeps_a_steady_force_and_smooths_a_jump():
    shown = np.zeros(3)
    for _ in range(120):
        shown = low_pass(shown, np.array([1.0, 0, 0]), 1 / 60)
    assert np.allclose(shown, [1, 0, 0], atol=1e-6)
    once = low_pass(np.zeros(1), np.ones(1), 1 / 60, cutoff_hz=5)
    assert once[0] == pytest.approx(1 - np.exp(-2 * np.pi * 5 / 60))
    twice = low_pass(low_pass(np.zeros(1), np.ones(1), 1 / 120), np.ones(1), 1 / 120)
    assert twice[0] == pytest.approx(once[0])


def test_sub_steps_count_what_moves_near_the_tissue():
    tool, turned = probe(0.0025), ToolPose(np.zeros(3), rotation_about(np.array([1.0, 0, 0]), 0.1))
    tip, shaft = np.array([[0, 0, 0.001]]), np.array([[0, 0.003, -0.09]])
    assert substeps_at(tool, ToolPose(np.zeros(3)), turned, tip) == 1
    way = 2 * np.hypot(0.09, 0.003) * np.sin(0.05)
    assert substeps_at(tool, ToolPose(np.zeros(3)), turned, shaft) == int(np.ceil(way / 0.002))


def test_friction_that_would_turn_round_is_as_stiff_as_sticking():
    """With f'(y) / y along the slip Newton's step on friction alone ends where it sticks."""
    rng = np.random.default_rng(5)
    normal = np.tile([0, 0, 1.0], (6, 1))
    slip, limit, smooth = rng.normal(size=(6, 3)) * [1e-4, 1e-4, 0], rng.uniform(1, 2, 6), 1e-5
    law = friction(slip, normal, limit, smooth)
    move = np.where(np.arange(6)[:, None] < 4, -2.0, 0.5) * slip
    rows, missing = held_back(slip, normal, limit, smooth, move)
    assert rows.tolist() == [0, 1, 2, 3]
    for k, more in zip(rows, missing, strict=True):
        flat = (law.blocks[k] + more)[:2, :2]
        step = -np.linalg.solve(flat, law.gradient[k, :2])
        assert np.allclose(slip[k, :2] + step, 0, atol=1e-12)


def test_crushed_tissue_is_stiffer_and_gentle_strain_is_not():
    crushed, plain = simulated_material(TISSUE), TISSUE.material
    j = np.linspace(0.05, 1.5, 400)
    energy, slope, curvature = crushed.volumetric(j)
    gentle = j > CRUSHED
    for mine, theirs in zip((energy, slope, curvature), plain.volumetric(j), strict=True):
        assert np.array_equal(mine[gentle], theirs[gentle])
    assert (slope[~gentle] < plain.volumetric(j)[1][~gentle]).all()
    h = 1e-6
    for value, derivative in ((0, slope), (1, curvature)):
        difference = (crushed.volumetric(j + h)[value] - crushed.volumetric(j - h)[value]) / (2 * h)
        assert np.abs(difference - derivative).max() < 1e-5 * np.abs(derivative).max()
    assert not np.isfinite(crushed.volumetric(np.array([-0.1]))[0]).any()
