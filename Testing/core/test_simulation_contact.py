"""Tools on tissue: balance of forces, no penetration, no jumping through, friction, grasp, slip, release, dimples."""

from dataclasses import replace

import numpy as np
import pytest
from simulation_examples import BOTTOM, SIZE, box_body

from organphys.ground.checks import InputError
from organphys.ground.solve_report import Stop
from organphys.simulation.advance import Motion, prepared
from organphys.simulation.grasp import allowed_at_anchors, passing_on
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.near_tools import near_samples, stretches
from organphys.simulation.newton_cg import EVALUATION, FEWEST
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import Grip, ToolPose
from organphys.simulation.tool_reach import tool_reach
from organphys.simulation.tools import Jaws, gripper, place, probe

POINTING_DOWN = np.diag([1.0, -1.0, -1.0])
OPTIONS = SimulationOptions(mass_damping=5)
TOP = SIZE[2]


def pose(x=0.05, z=0.05, jaw=0.0, y=0.02):
    return ToolPose(np.array([x, y, z]), POINTING_DOWN, jaw)


def driven(body, tool, poses, options=OPTIONS, detail=None):
    """Simulation and reports of a tool that takes the poses, one per 1/60 s."""
    scene = Scene((body,), (tool,), options)
    simulation = Simulation(scene, scene.initial_state(poses[0]), detail=detail)
    return simulation, [simulation.step((p,)) for p in poses]


def poke(depth, steps=45, hold=30):
    return [pose(z=TOP + 0.004 - (depth + 0.004) * min(k / steps, 1)) for k in range(steps + hold)]


def test_the_tool_feels_what_the_pins_feel():
    body = box_body(BOTTOM)
    simulation, reports = driven(body, probe(), poke(0.006))
    force = reports[-1].forces[0].force
    pull = body.held @ simulation.state.bodies[0].z
    on_pins = [float((body.basis.affine_coordinates(np.zeros((3, 3)), axis) * pull).sum()) for axis in np.eye(3)]
    assert force[2] > 1.0 and np.abs(force[:2]).max() < 0.1 * force[2]
    assert np.abs(force + on_pins).max() < 5e-3 * force[2]
    assert all(r.bodies[0].solve.stop is Stop.CONVERGED for r in reports)
    assert max(r.bodies[0].deepest_m for r in reports) < 3e-4
    assert np.abs([r.bodies[0].volume_change for r in reports]).max() < 0.04


def test_force_does_not_depend_on_the_number_of_samples():
    forces = []
    for spacing in (1.2e-3, 0.6e-3):
        _, reports = driven(box_body(BOTTOM, sample_spacing=spacing), probe(), poke(0.005))
        forces.append((reports[-1].forces[0].force[2], reports[-1].bodies[0].contacts))
    assert forces[1][1] > 2.5 * forces[0][1]
    assert forces[1][0] == pytest.approx(forces[0][0], rel=0.1)


def test_a_fast_tool_never_jumps_through():
    speed, radius = 0.2, 0.0012
    poses = [pose(z=TOP + 0.010 - speed * k / 60) for k in range(10)]
    assert speed / 60 > 2 * radius
    simulation, reports = driven(box_body(BOTTOM, sample_spacing=0.6e-3), probe(radius), poses)
    body, state = simulation.scene.bodies[0], simulation.state.bodies[0]
    middle = np.flatnonzero(
        (np.hypot(*(body.samples.points[:, :2] - SIZE[:2] / 2).T) < 2e-3) & (body.samples.points[:, 2] > TOP - 1e-6)
    )
    assert poses[-1].position[2] < TOP - 0.015
    assert body.sample_positions(state.z, middle)[:, 2].max() < poses[-1].position[2]
    assert max(r.bodies[0].deepest_m for r in reports) < radius
    assert max(r.substeps for r in reports) >= 3
    assert max(r.effort for r in reports) <= OPTIONS.effort + EVALUATION * FEWEST * max(r.substeps for r in reports)
    assert min(r.bodies[0].min_det for r in reports) > 0


def test_a_tool_that_starts_inside_is_pushed_out_of_the_tissue_near_it():
    simulation, reports = driven(box_body(BOTTOM), probe(), [pose(z=TOP - 0.001)] * 20)
    assert reports[0].bodies[0].deepest_m + 1e-3 > 5e-4
    assert reports[-1].bodies[0].deepest_m < 3e-4
    assert max(r.bodies[0].solve.iterations for r in reports) < 30
    assert np.isfinite(simulation.state.bodies[0].z).all()


@pytest.mark.parametrize("coefficient", [0.0, 0.3])
def test_sliding_friction_is_the_coefficient_times_the_push(coefficient):
    down, along = poke(0.005, steps=30, hold=0), [pose(x=0.05 + 0.015 * k / 50, z=TOP - 0.005) for k in range(50)]
    body = box_body(BOTTOM, sample_spacing=1e-3)
    _, reports = driven(body, probe(), down + along, replace(OPTIONS, friction=coefficient))
    late = np.mean([r.forces[0].force for r in reports[-20:]], axis=0)
    assert -late[0] / late[2] == pytest.approx(coefficient, abs=0.07)
    assert abs(late[1]) < 0.05 * late[2]


def grasp_and_lift(limit, lift=0.010):
    """Down with open jaws, close, lift, open."""
    jaws = Jaws(force_limit=limit)
    down = [pose(z=TOP + 0.016 - 0.013 * k / 20, jaw=60) for k in range(21)]
    close = [pose(z=TOP + 0.003, jaw=60 - 2.75 * k) for k in range(1, 21)]
    up = [pose(z=TOP + 0.003 + lift * k / 40, jaw=5) for k in range(1, 41)]
    hold = [pose(z=TOP + 0.003 + lift, jaw=5)] * 10
    half = [pose(z=TOP + 0.003 + lift, jaw=15)] * 5
    opened = [pose(z=TOP + 0.003 + lift, jaw=60)] * 40
    parts = (down, close, up, hold, half, opened)
    simulation, reports = driven(box_body(BOTTOM), gripper(jaws), [p for part in parts for p in part])
    ends = np.cumsum([len(part) for part in parts])
    return simulation, reports, ends


def test_grasp_lifts_holds_with_hysteresis_and_lets_go():
    simulation, reports, ends = grasp_and_lift(limit=20.0)
    pull = np.array([r.forces[0].force[2] for r in reports])
    assert pull[ends[3] - 1] < -0.5  # lifted tissue pulls the tool down
    assert pull[ends[4] - 1] == pytest.approx(pull[ends[3] - 1], rel=0.05)  # 15 deg: closed at 12, opens at 20 only
    assert abs(pull[-1]) < 1e-3
    assert not simulation.state.bodies[0].grips[0].closed
    assert max(r.bodies[0].min_det for r in reports) < 1.001
    assert np.abs(simulation.state.bodies[0].z).max() < 2e-3 * SIZE.max()  # back to where it was


def test_the_grip_slips_at_its_limit():
    _, reports, ends = grasp_and_lift(limit=0.8, lift=0.02)
    lifting = [np.linalg.norm(r.forces[0].force) for r in reports[ends[1] + 5 : ends[3]]]
    assert 0.3 < max(lifting) < 0.8 * 1.1
    assert lifting[-1] < 0.1  # slipped out


def test_local_detail_makes_a_dimple():
    body, still = box_body(BOTTOM), []
    forces = {}
    for name, detail in (("handles", None), ("local", LocalDetail(radius=0.008))):
        simulation, reports = driven(body, probe(), poke(0.006), detail=detail)
        now = simulation.scene.bodies[0]
        top = np.flatnonzero(now.samples.points[:, 2] > TOP - 1e-6)
        sunk = TOP - now.sample_positions(simulation.state.bodies[0].z, top)[:, 2]
        away = np.hypot(*(now.samples.points[top, :2] - SIZE[:2] / 2).T)
        still.append(sunk[(away > 0.008) & (away < 0.010)].mean() / sunk[away < 0.002].mean())
        forces[name] = reports[-1].forces[0].force[2]
        assert min(r.bodies[0].min_det for r in reports) > 0
    assert still[1] < 0.6 * still[0]
    assert forces["local"] < 0.7 * forces["handles"]


def test_local_detail_goes_when_the_tool_has_gone():
    away = [pose(z=TOP + 0.02)] * 60
    simulation, _ = driven(box_body(BOTTOM), probe(), poke(0.004, hold=0) + away, detail=LocalDetail(radius=0.008))
    assert simulation.scene.bodies[0].plain is None
    assert simulation.state.bodies[0].z.shape == (simulation.scene.bodies[0].basis.size, 3)


def test_bad_poses_are_refused_and_nothing_changes():
    scene = Scene((box_body(BOTTOM),), (probe(),), replace(OPTIONS, gravity=gravity_along([0, 0, -1])))
    simulation = Simulation(scene, scene.initial_state(pose()))
    before = simulation.snapshot
    with pytest.raises(InputError, match="three finite numbers"):
        simulation.step((ToolPose(np.array([np.nan, 0, 0])),))
    with pytest.raises(InputError, match="expected 1, one per tool, got 0"):
        simulation.step(())
    assert simulation.snapshot is before and not simulation.recording().events


def test_the_search_for_near_samples_finds_all_of_them():
    body = box_body(BOTTOM)
    z = np.random.default_rng(0).normal(size=(body.basis.size, 3))
    z *= 0.5 / np.abs(body.strain.rates(z)).max()
    parts = place(gripper(), pose(z=TOP, jaw=40))
    everything = np.arange(len(body.samples.points))
    x = body.sample_positions(z, everything)
    gaps = np.min([part.gap_and_normal(x)[0] for part in parts], axis=0)
    assert np.array_equal(near_samples(body, z, parts, 0.003), everything[gaps < 0.003])
    f = body.strain.gradients(z).transpose(2, 0, 1)
    largest = np.linalg.svd(f)[1][:, 0]
    bound = stretches(body.strain.gradients(z))
    assert (bound >= largest * (1 - 1e-9)).all() and (bound <= 1.4 * largest).all()


def test_tissue_caught_between_jaws_passes_and_comes_back_when_it_has_left():
    samples, radii = np.array([4, 7, 9]), np.array([0.002, 0.002])
    across = np.tile([0, 1.0, 0], (3, 1))
    normals, gaps = np.stack([across, -across]), np.array([[-1e-3, 1e-3, 0.01], [1e-3, -1e-3, 0.01]])
    caught = passing_on(Grip(), samples, gaps, normals, radii, 1e-3, 1e-3)
    assert caught.passing.tolist() == [4, 7]
    same_side = passing_on(Grip(), samples, gaps, np.stack([across, across]), radii, 1e-3, 1e-3)
    assert not len(same_side.passing)
    assert passing_on(caught, samples, np.full((2, 3), 5e-4), normals, radii, 1e-3, 1e-3).passing.tolist() == [4, 7]
    assert not len(passing_on(caught, samples, np.full((2, 3), 5e-3), normals, radii, 1e-3, 1e-3).passing)


def test_what_jaws_have_let_go_leaves_them():
    """Jaws that close on tissue, drag it sideways beyond their grip and open: no tissue stays inside them."""
    down = [pose(z=TOP + 0.016 - 0.013 * k / 20, jaw=60 - 2.75 * k) for k in range(21)]
    along = [pose(x=0.05 + 0.02 * k / 20, z=TOP + 0.003, jaw=5 + 0.7 * k) for k in range(1, 21)]
    away = [pose(x=0.07 + 0.01 * k / 20, z=TOP + 0.003, jaw=19 + k) for k in range(1, 21)]
    simulation, reports = driven(box_body(BOTTOM, sample_spacing=1e-3), gripper(Jaws(force_limit=3.0)), down + along)
    assert len(simulation.state.bodies[0].grips[0].sample)  # it holds something
    reports += [simulation.step((p,)) for p in away]
    assert not len(simulation.state.bodies[0].grips[0].passing)
    assert max(r.bodies[0].deepest_m for r in reports) < 3e-4
    forces = [np.linalg.norm(r.forces[0].force) for r in reports]
    assert forces[-1] < 0.7 * forces[-20]  # the open jaws are dragged on, past the tissue


def test_held_tissue_may_be_as_deep_as_its_anchor_and_is_pushed_out_as_the_jaws_open():
    gaps, jaws = np.array([[-1e-3, 5e-4, 3e-3]]), Jaws(close_deg=12, open_deg=20)
    shut, half, wide = (allowed_at_anchors(gaps, pose(jaw=deg), jaws, 1e-3) for deg in (5, 16, 25))
    assert np.allclose(shut, [[2e-3, 5e-4, 0]])
    assert np.allclose(half, 0.5 * shut) and not wide.any()


def test_local_functions_follow_the_contact_without_pushing_tissue_into_the_tool():
    body = box_body(BOTTOM, sample_spacing=1e-3)
    slide = [pose(x=0.05 + 0.02 * k / 60, z=TOP - 0.005) for k in range(1, 61)]
    simulation, reports = driven(body, probe(), poke(0.005, hold=0) + slide, detail=LocalDetail(radius=0.01))
    middle = simulation.scene.bodies[0].basis.local.functions.middle
    assert middle[0] > 0.055  # they went with what the tool touches
    assert max(r.bodies[0].deepest_m for r in reports) < 3e-4
    forces = np.array([np.linalg.norm(r.forces[0].force) for r in reports])
    assert np.abs(np.diff(forces)).max() < 0.5 * forces.max()
    assert min(r.bodies[0].min_det for r in reports) > 0.2


def test_the_bend_of_a_tool_softens_what_it_touches_but_not_what_is_inside_it():
    body, at = box_body(BOTTOM), pose(z=TOP - 0.0012)
    scene = Scene((body,), (probe(),), OPTIONS)
    state, motion = scene.initial_state(at).bodies[0], Motion(scene.tools, (at,), (at,), scene.part_owner)
    reach = tool_reach(body, state, motion.new, 0.0, OPTIONS, 1 / 60)
    terms = prepared(body, state, motion, OPTIONS, 1 / 60, reach).potential.contact
    value = terms.value(state.z)
    softest = np.linalg.eigvalsh(terms.whole_blocks(state.z, value))[:, 0]
    gap = terms.gaps(terms.start)[0].min(axis=0)
    inside, touched = gap < 0, (gap >= 0) & (gap < terms.width)
    assert inside.any() and touched.any()
    assert (softest[inside] >= -1e-9).all() and (softest[touched] < 0).all()
