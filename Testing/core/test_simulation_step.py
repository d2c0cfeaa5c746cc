"""Time stepping without tools: derivatives, exact motions, orders of convergence, energy, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_examples import SIZE, TISSUE, box_body

from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_about
from organphys.ground.solve_report import Stop
from organphys.simulation.advance import LEAST_EFFORT, OVERHEAD
from organphys.simulation.incremental_potential import IncrementalPotential
from organphys.simulation.newton_cg import EVALUATION, FEWEST
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.pins import Pin
from organphys.simulation.scene import Scene
from organphys.simulation.state import BodyState, SceneState
from organphys.simulation.step import step
from organphys.simulation.strain_energy import Viscosity
from organphys.simulation.time_scheme import SchemeStep

DOWN = gravity_along([0, 0, -1])
PLAIN = SimulationOptions(mass_damping=0, stiffness_damping=0)
END = Pin((0.0, 0.02, 0.02), 0.032)


def run(body, options, steps, dt, z=None, velocity=None):
    scene = Scene((body,), options=options)
    zero = np.zeros((body.basis.size, 3))
    z, velocity = (zero if value is None else value for value in (z, velocity))
    states = [SceneState((BodyState(z, velocity, zero, zero, zero),))]
    for _ in range(steps):
        state, report = step(scene, states[-1], (), dt)
        assert report.bodies[0].solve.stop is Stop.CONVERGED
        assert report.bodies[0].min_det > 0
        states.append(state)
    return [state.bodies[0] for state in states]


def energy(body, options, state):
    strain = body.strain.energy_and_stress(body.strain.gradients(state.z), None)[0]
    fall = -body.mass * float((body.mean_phi @ state.z) @ options.gravity)
    held = 0.5 * float((state.z * (body.held @ state.z)).sum())
    return strain + fall + held + 0.5 * body.mass * float((state.velocity**2).sum())


def bent(body, size=0.3, seed=0):
    z = np.random.default_rng(seed).normal(size=(body.basis.size, 3))
    z *= size / np.abs(body.strain.rates(z)).max()
    return z


def test_gradient_and_hessian_product_match_differences():
    body = box_body(END)
    z, before, change = bent(body), bent(body, 0.1, 1), bent(body, 0.2, 2)
    options = SimulationOptions(gravity=DOWN, mass_damping=3.0, stiffness_damping=0.05)
    scheme = SchemeStep(before, 5 * bent(body, 0.1, 3), 0.01, bent(body, 0.15, 4))
    potential = IncrementalPotential.of_step(body, options, scheme, None)
    at = potential.evaluate(z)
    for step_size, order in ((1e-4, 1), (1e-5, 1)):
        ends = [potential.evaluate(z + side * step_size * change) for side in (-order, order)]
        slope = (ends[1].energy - ends[0].energy) / (2 * step_size)
        assert slope == pytest.approx(float((at.gradient * change).sum()), rel=1e-6)
        product = (ends[1].gradient - ends[0].gradient) / (2 * step_size)
        hessian = potential.product(potential.tangent(at), change)
        assert np.abs(product - hessian).max() < 2e-5 * np.abs(product).max()


def test_energy_of_a_uniform_deformation_is_that_of_its_density():
    body = box_body()
    f = np.array([[1.1, 0.1, 0], [0.05, 0.95, 0.02], [0, -0.1, 1.02]])
    z = body.basis.affine_coordinates(f - np.eye(3), np.array([0.1, 0.2, 0.3]))
    value = body.strain.energy_and_stress(body.strain.gradients(z), None)[0]
    assert value == pytest.approx(SIZE.prod() * TISSUE.material.energy(f[None])[0], rel=1e-9)


def test_rigid_turns_cost_nothing_and_viscosity_does_not_feel_them():
    body = box_body()
    turn = rotation_about(np.array([1.0, 2, 3]), 1.2)
    z = body.basis.affine_coordinates(turn - np.eye(3), np.zeros(3))
    f = body.strain.gradients(z)
    assert abs(body.strain.energy_and_stress(f, None)[0]) < 1e-12
    spin = body.basis.affine_coordinates(np.cross(np.eye(3), [0.1, 0.2, 0.3]) @ turn, np.zeros(3))
    viscosity = Viscosity(10.0, f, f)
    lazy = body.strain.energy_and_stress(f + 1e-3 * body.strain.rates(spin), viscosity)[0]
    stretch = body.basis.affine_coordinates(np.diag([0.1, 0.2, 0.3]) @ turn, np.zeros(3))
    felt = body.strain.energy_and_stress(f + 1e-3 * body.strain.rates(stretch), viscosity)[0]
    assert lazy < 1e-4 * felt


def test_free_fall_is_exact():
    body, dt, steps = box_body(), 0.01, 30
    options = replace(PLAIN, gravity=DOWN)
    for scheme in ("backward_euler", "bdf2"):
        states = run(body, replace(options, scheme=scheme), steps, dt)
        expected = body.basis.affine_coordinates(np.zeros((3, 3)), DOWN)
        assert np.abs(states[-1].velocity - steps * dt * expected).max() < 1e-9
    fallen = body.centre_of_mass(run(body, options, steps, dt)[-1].z) - body.centre_of_mass(0 * states[0].z)
    assert fallen[2] == pytest.approx(DOWN[2] * dt**2 * steps * (steps + 1) / 2, rel=1e-9)


def test_momentum_is_kept_in_free_flight():
    body = box_body()
    push = body.basis.affine_coordinates(np.diag([0.5, -0.3, 0.2]), np.array([0.1, 0, 0.3]))
    states = run(body, replace(PLAIN, tolerance=1e-8), 40, 0.01, bent(body), push)
    momenta = [body.mass * body.mean_phi @ state.velocity for state in states]
    assert np.abs(momenta - momenta[0]).max() < 1e-7 * np.linalg.norm(momenta[0])
    assert np.linalg.norm(states[-1].velocity - states[0].velocity) > 0.03 * np.linalg.norm(states[0].velocity)


def test_energy_never_grows_undriven():
    body = box_body(END)
    options = replace(PLAIN, gravity=DOWN)
    states = run(body, options, 80, 1 / 60, bent(body, 0.5))
    energies = np.array([energy(body, options, state) for state in states])
    assert (np.diff(energies) <= 2e-3 * np.ptp(energies)).all()  # the tolerance of the solver
    assert energies[-1] < energies[0] - 0.5 * np.ptp(energies)
    damped = run(body, replace(options, stiffness_damping=0.05), 80, 1 / 60, bent(body, 0.5))
    kinetic = [0.5 * body.mass * (s[-1].velocity ** 2).sum() for s in (states, damped)]
    assert kinetic[1] < 0.3 * kinetic[0]


@pytest.mark.parametrize(("scheme", "order"), [("backward_euler", 1), ("bdf2", 2)])
def test_order_of_the_scheme(scheme, order):
    body = box_body(END)
    options = SimulationOptions(gravity=DOWN, scheme=scheme, mass_damping=1, stiffness_damping=0.02, tolerance=1e-8)
    ends = [run(body, options, count, 0.064 / count)[-1].z for count in (16, 32, 64)]
    measured = np.log2(np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2]))
    assert order - 0.25 < measured < order + 0.4


def test_stopping_early_costs_no_more_than_the_stated_error():
    body = box_body(END)
    options = SimulationOptions(gravity=DOWN)
    start = SceneState((run(body, options, 10, 1 / 60)[-1],))
    rough, report = step(Scene((body,), options=replace(options, tolerance=0.05)), start, (), 1 / 60)
    exact, _ = step(Scene((body,), options=replace(options, tolerance=1e-10)), start, (), 1 / 60)
    error = np.linalg.norm(rough.bodies[0].z - exact.bodies[0].z)  # rms over the volume: the basis is orthonormal
    assert 0 < error <= report.bodies[0].error_m < 1e-3


def test_a_turned_world_gives_the_turned_result():
    body, options = box_body(), replace(PLAIN, tolerance=1e-8)
    turn = rotation_about(np.array([2.0, -1, 0.5]), 0.9)
    lean = body.basis.affine_coordinates(turn - np.eye(3), np.zeros(3))
    straight = run(body, options, 15, 0.01, bent(body))[-1].z
    turned = run(body, options, 15, 0.01, bent(body) @ turn.T + lean)[-1].z
    assert np.abs(turned - (straight @ turn.T + lean)).max() < 1e-8


def test_sag_does_not_depend_on_the_time_step_and_pins_hold():
    body = box_body(END)
    options = SimulationOptions(gravity=DOWN, mass_damping=20, tolerance=1e-5)
    ends = [run(body, options, count, dt)[-1].z for count, dt in ((120, 1 / 30), (60, 1 / 15))]
    sag = body.vertices(ends[0])[:, 2] - body.samples.vertices[:, 2]
    assert sag.min() < -0.01
    assert np.abs(ends[0] - ends[1]).max() < 1e-3 * np.abs(ends[0]).max()
    held = np.linalg.norm(body.samples.vertices - END.centre, axis=1) < 0.02
    moved = np.linalg.norm(body.vertices(ends[0]) - body.samples.vertices, axis=1)
    assert moved[held].max() < 0.05 * moved.max()


def test_gravity_that_the_registered_shape_carries_does_not_bend_it_again():
    body = box_body(END)
    hanging = replace(PLAIN, gravity=DOWN, registered_gravity=DOWN, mass_damping=20)
    assert not run(body, hanging, 20, 1 / 60)[-1].z.any()
    turned = replace(hanging, gravity=-DOWN)  # turned over: it feels the difference, twice its weight
    twice = replace(hanging, gravity=-2 * DOWN, registered_gravity=np.zeros(3))
    one, other = (run(body, options, 20, 1 / 60)[-1].z for options in (turned, twice))
    assert np.array_equal(one, other) and np.abs(one).max() > 1e-3
    with pytest.raises(InputError, match="registered gravity"):
        replace(hanging, registered_gravity=np.array([0, 0, np.nan]))
    assert not Scene((box_body(),), options=hanging).notices()


def test_a_step_costs_no_more_than_the_effort_and_says_so():
    body = box_body(END)
    scene = Scene((body,), options=SimulationOptions(gravity=60 * DOWN, stiffness_damping=0, effort=8))
    state = scene.initial_state()
    for _ in range(6):
        state, report = step(scene, state, (), 1 / 30)
        one = report.bodies[0]
        assert report.effort <= OVERHEAD + LEAST_EFFORT + EVALUATION * FEWEST  # one line search may overrun it
        assert one.min_det > 0
    assert one.solve.stop is Stop.STEP_LIMIT and one.solve.residual > scene.options.tolerance


def test_violent_forces_never_turn_tissue_inside_out():
    body = box_body(END)
    scene = Scene((body,), options=SimulationOptions(gravity=100 * DOWN, stiffness_damping=0, newton_steps=10))
    state = scene.initial_state()
    for _ in range(20):
        state, report = step(scene, state, (), 1 / 60)
        assert report.bodies[0].min_det > 0
        assert np.isfinite(state.bodies[0].z).all()
    assert report.bodies[0].min_det < 0.5


def test_the_same_arguments_give_the_same_bits():
    body = box_body(END)
    options = SimulationOptions(gravity=DOWN)
    first, second = (run(body, options, 10, 1 / 60)[-1] for _ in range(2))
    assert np.array_equal(first.z, second.z) and np.array_equal(first.velocity, second.velocity)


def test_bad_input_is_refused():
    scene = Scene((box_body(),))
    for dt in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="dt"):
            step(scene, scene.initial_state(), (), dt)
    with pytest.raises(InputError, match="gravity"):
        SimulationOptions(gravity=np.array([0, np.nan, 0]))
    with pytest.raises(InputError, match="scheme"):
        SimulationOptions(scheme="euler")
    with pytest.raises(InputError, match="gravity direction"):
        gravity_along([0, 0, 0])
    with pytest.raises(InputError, match="at least one body"):
        Scene(())
    assert [n.code for n in Scene((box_body(),), options=replace(PLAIN, gravity=DOWN)).notices()] == ["unpinned"]
    assert not Scene((box_body(END),), options=replace(PLAIN, gravity=DOWN)).notices()
