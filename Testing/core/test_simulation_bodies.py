"""Organs side by side touch each other: no penetration, momentum kept, derivatives, and no touch at a distance."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_examples import BOTTOM, SIZE, TISSUE, box_body, box_grid, box_surface

from organphys.simulation.advance import Motion
from organphys.simulation.advance import prepared as prepare
from organphys.simulation.body import build_body
from organphys.simulation.body_contact import body_pairs, surface_normals
from organphys.simulation.joint_potential import JointPotential
from organphys.simulation.options import SimulationOptions
from organphys.simulation.rest_shape import rest_shape
from organphys.simulation.scene import Scene
from organphys.simulation.state import SceneState
from organphys.simulation.step import step
from organphys.simulation.tool_reach import tool_reach

OPTIONS = SimulationOptions(mass_damping=0, stiffness_damping=0.002, tolerance=1e-4)
DT = 1 / 60


def neighbour(gap, *pins):
    """A smaller box above the example box, ``gap`` m away."""
    size = np.array([0.05, 0.03, 0.03])
    corner = np.array([0.02, 0.004, SIZE[2] + gap])
    points = corner + box_grid(size, 0.005)
    vertices, faces = box_surface(size, 0.005)
    volumes = np.full(len(points), size.prod() / len(points))
    options = {"handles": 8, "quadrature": 300, "nodes": 80, "sample_spacing": 2e-3}
    shape = rest_shape(points, volumes, corner + vertices, faces, tissue=TISSUE, **options)
    return build_body(shape, pins=pins, tissue=TISSUE, name="neighbour")


def thrown(bodies, speeds):
    """The scene and its state with each body at a speed (3,) m/s."""
    scene = Scene(bodies, options=OPTIONS)
    state = scene.initial_state()
    moving = [
        replace(one, velocity=body.basis.affine_coordinates(np.zeros((3, 3)), np.array(speed)))
        for one, body, speed in zip(state.bodies, bodies, speeds, strict=True)
    ]
    return scene, SceneState(tuple(moving))


def momentum(scene, state):
    return sum(body.mass * body.mean_phi @ one.velocity for body, one in zip(scene.bodies, state.bodies, strict=True))


def depth(scene, state):
    """How deep any contact sample of the upper body is below the lower one's deformed top, m, over their middles."""
    low, high = scene.bodies
    top = np.flatnonzero(low.samples.points[:, 2] > SIZE[2] - 1e-6)
    base = np.flatnonzero(high.samples.points[:, 2] < high.samples.points[:, 2].min() + 1e-6)
    x = low.sample_positions(state.bodies[0].z, top)
    y = high.sample_positions(state.bodies[1].z, base)
    nearest = ((y[:, None, :2] - x[None, :, :2]) ** 2).sum(2).argmin(1)
    inside = (np.abs(y[:, 0] - 0.045) < 0.02) & (np.abs(y[:, 1] - 0.019) < 0.01)
    return float((x[nearest, 2] - y[:, 2])[inside].max())


def test_two_free_organs_collide_without_penetration_and_keep_their_momentum():
    scene, state = thrown((box_body(), neighbour(0.003)), ([0, 0, 0.1], [0, 0, -0.2]))
    start, deepest, pushed = momentum(scene, state), 0.0, False
    for _ in range(30):
        before = momentum(scene, state)
        state, report = step(scene, state, (), DT)
        deepest = max(deepest, depth(scene, state), *(one.deepest_m for one in report.bodies))
        assert min(one.min_det for one in report.bodies) > 0
        assert np.linalg.norm(momentum(scene, state) - before) < 2e-3 * np.linalg.norm(start) + 1e-6
        pushed |= report.bodies[0].solve.iterations > 0
    up = [float((body.mean_phi @ one.velocity)[2]) for body, one in zip(scene.bodies, state.bodies, strict=True)]
    assert pushed and deepest < 3e-4
    assert up[1] > up[0]  # they part again
    assert np.linalg.norm(momentum(scene, state) - start) < 0.01 * np.linalg.norm(start)


def test_an_organ_lies_on_a_held_one_which_bears_its_weight():
    options = replace(OPTIONS, gravity=np.array([0, 0, -9.81]), mass_damping=8.0)
    scene = Scene((box_body(BOTTOM), neighbour(0.001)), options=options)
    state, (low, high), borne = scene.initial_state(), scene.bodies, []
    lift = low.basis.affine_coordinates(np.zeros((3, 3)), np.array([0, 0, 1.0]))
    for _ in range(40):  # it slides off slowly: there is no friction between bodies
        state, report = step(scene, state, (), DT)
        assert max(one.deepest_m for one in report.bodies) < 3e-4
        borne.append(-float((lift * (low.held @ state.bodies[0].z)).sum()))
    assert np.mean(borne[-15:]) == pytest.approx((low.mass + high.mass) * 9.81, rel=0.03)
    assert depth(scene, state) < 3e-4


def test_energy_and_products_of_the_joint_potential_match_differences():
    bodies = (box_body(BOTTOM), neighbour(0.0005))
    _, state = thrown(bodies, ([0, 0, 0.02], [0.01, 0, -0.03]))
    pairs = body_pairs(bodies, state.bodies, OPTIONS, DT)
    motion = Motion((), (), (), np.zeros(0, dtype=np.int64))
    parts = tuple(
        prepare(b, s, motion, OPTIONS, DT, tool_reach(b, s, (), 0.0, OPTIONS, DT)).potential
        for b, s in zip(bodies, state.bodies, strict=True)
    )
    joint = JointPotential(parts, pairs)
    rng = np.random.default_rng(0)
    z, change = (1e-5 * rng.normal(size=(sum(b.basis.size for b in bodies), 3)) for _ in range(2))
    at, step_size = joint.evaluate(z), 1e-3
    assert at.pairs.energy > 0
    ends = [joint.evaluate(z + side * step_size * change) for side in (-1, 1)]
    slope = (ends[1].energy - ends[0].energy) / (2 * step_size)
    assert slope == pytest.approx(float((at.gradient * change).sum()), rel=1e-5)
    product = (ends[1].gradient - ends[0].gradient) / (2 * step_size)
    assert np.abs(product - joint.product(joint.tangent(at), change)).max() < 1e-3 * np.abs(product).max()


def test_bodies_far_apart_do_not_feel_each_other_and_normals_turn_with_the_tissue():
    low, high = box_body(BOTTOM), neighbour(0.02)
    scene, state = thrown((low, high), ([0, 0, 0], [0, 0, -0.05]))
    assert body_pairs(scene.bodies, state.bodies, OPTIONS, DT) is None
    shear = low.basis.affine_coordinates(np.array([[0, 0, 0], [0, 0, 0], [0.3, 0, 0]]), np.zeros(3))
    top = np.flatnonzero((low.samples.points[:, 2] > SIZE[2] - 1e-6) & (np.abs(low.samples.points[:, 0] - 0.05) < 0.02))
    top = top[np.abs(low.samples.points[top, 1] - 0.02) < 0.01]
    expected = np.array([-0.3, 0, 1]) / np.hypot(0.3, 1)
    assert np.abs(surface_normals(low, shear, top) - expected).max() < 1e-6
