"""A running simulation: record and replay, undo, reset, edits while it runs, several bodies, an asset from disk."""

from dataclasses import replace

import numpy as np
import pytest
from asset_examples import bent_organ
from simulation_examples import BOTTOM, SIZE, TISSUE, box_body, box_shape
from threadpoolctl import threadpool_info, threadpool_limits

from organphys.asset.asset_file import load_asset, save_asset
from organphys.ground.checks import InputError
from organphys.simulation import session
from organphys.simulation.body import build_body
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.organ_body import metres_per_unit, organ_body, scene_direction
from organphys.simulation.pins import Pin
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation, replay
from organphys.simulation.state import ToolPose
from organphys.simulation.step import step
from organphys.simulation.tools import gripper, probe

POINTING_DOWN = np.diag([1.0, -1.0, -1.0])
OPTIONS = SimulationOptions(gravity=gravity_along([0, 0, -1]))
END = Pin((0.0, 0.02, 0.02), 0.032)


def pose(k, x=0.05):
    return ToolPose(np.array([x, 0.02, SIZE[2] + 0.004 - 0.0004 * k]), POINTING_DOWN, max(60.0 - 4 * k, 5))


def poking(detail=None):
    scene = Scene((box_body(BOTTOM),), (gripper(),), OPTIONS)
    return Simulation(scene, scene.initial_state(pose(0)), detail=detail)


def same(a, b):
    return all(
        np.array_equal(x.z, y.z) and np.array_equal(x.velocity, y.velocity)
        for x, y in zip(a.bodies, b.bodies, strict=True)
    )


@pytest.mark.parametrize("detail", [None, LocalDetail(radius=0.008)])
def test_a_replay_gives_the_same_bits_with_edits_and_grasp(detail):
    simulation = poking(detail)
    for k in range(20):
        simulation.step((pose(k),), dt=1 / 60 if k < 10 else 1 / 90)
        if k == 8:
            simulation.set_pins(0, BOTTOM, END)
        if k == 12:
            simulation.set_options(replace(OPTIONS, friction=0.0))
    moments = replay(simulation.recording())
    assert len(moments) == 23
    assert same(moments[-1].state, simulation.state)
    assert simulation.state.bodies[0].grips[0].closed
    assert moments[-1].state.time == simulation.state.time == pytest.approx(10 / 60 + 10 / 90)


def test_undo_goes_back_to_the_mark_and_the_recording_with_it():
    simulation = poking()
    for k in range(5):
        simulation.step((pose(k),))
    simulation.mark()
    before = simulation.snapshot
    for k in range(5, 10):
        simulation.step((pose(k),))
    simulation.set_pins(0, END)
    simulation.undo()
    assert simulation.snapshot is before and len(simulation.recording().events) == 5
    with pytest.raises(InputError, match="nothing to undo"):
        simulation.undo()
    simulation.reset()
    assert simulation.state.time == 0 and not simulation.state.bodies[0].z.any()
    simulation.restore(before)
    assert simulation.state is before.state and simulation.recording().start is before


def test_new_pins_keep_shape_and_speed():
    scene = Scene((box_body(END),), options=OPTIONS)
    simulation = Simulation(scene, scene.initial_state())
    for _ in range(15):
        simulation.step()
    old, state = simulation.scene.bodies[0], simulation.state.bodies[0]
    simulation.set_pins(0, END, Pin((0.1, 0.02, 0.02), 0.025))
    new, moved = simulation.scene.bodies[0], simulation.state.bodies[0]
    sag = old.vertices(state.z) - old.samples.vertices
    assert np.abs(sag).max() > 0.02
    assert np.linalg.norm(new.vertices(moved.z) - old.vertices(state.z), axis=1).mean() < 0.05 * np.abs(sag).max()
    speeds = (old.mean_phi @ state.velocity, new.mean_phi @ moved.velocity)
    assert np.allclose(*speeds, atol=1e-6 * np.abs(speeds).max())
    with pytest.raises(InputError, match="expected a number from 0 to 0, got 1"):
        simulation.set_pins(1)


def test_bodies_side_by_side_move_as_if_alone():
    pin = Pin((0.0, 0.22, 0.02), 0.032)
    far = build_body(box_shape(beside=0.2), pins=(pin,), tissue=TISSUE, name="far")
    near, tools = box_body(BOTTOM), (probe(), probe())
    both, alone = Scene((far, near), tools, OPTIONS), Scene((near,), tools, OPTIONS)

    def poses(k):
        here = pose(k, x=0.03)
        return here, replace(here, position=here.position + np.array([0, 0.2, 0]))

    two, one = (Simulation(scene, scene.initial_state(*poses(0))) for scene in (both, alone))
    for k in range(20):
        reports = [simulation.step(poses(k)) for simulation in (two, one)]
    assert np.array_equal(two.state.bodies[1].z, one.state.bodies[0].z)
    assert reports[1].forces[0].force[2] > 0.1
    assert np.array_equal(reports[0].forces[0].force, reports[1].forces[0].force)
    assert reports[0].forces[1].force[2] > 0.1 and not reports[1].forces[1].force.any()


def test_the_organ_of_an_asset_file_falls_alone(tmp_path):
    organ = bent_organ()
    save_asset(organ, tmp_path / "organ.organphys")
    body = organ_body(load_asset(tmp_path / "organ.organphys"), handles=8, quadrature=300, sample_spacing=4e-3)
    again = organ_body(organ, handles=8, quadrature=300, sample_spacing=4e-3)
    assert np.array_equal(body.strain.rows, again.strain.rows)
    scene = Scene((body,), options=replace(OPTIONS, gravity=gravity_along(scene_direction(organ, [0, -1, 0]))))
    simulation = Simulation(scene, scene.initial_state())
    for _ in range(6):
        simulation.step(dt=0.01)
    drop = body.centre_of_mass(simulation.state.bodies[0].z) - body.centre_of_mass(np.zeros((body.basis.size, 3)))
    along = organ.T_scene_ct.rotation @ [0, -1, 0]
    assert np.allclose(drop, 9.80665 * 1e-4 * 21 * along / (1 + 0.5 * 0.01), rtol=0.02)
    assert [n.code for n in scene.notices()] == ["unpinned"]


def test_the_body_of_an_organ_has_the_organ_s_size_in_metres():
    organ = bent_organ()
    body = organ_body(organ, handles=8, quadrature=300, sample_spacing=4e-3)
    assert metres_per_unit(organ) == pytest.approx(0.1)
    assert body.shape.volumes.sum() == pytest.approx(1e-6 * organ.volume_ml, rel=0.05)
    assert body.mass == pytest.approx(1050 * body.shape.volumes.sum())
    assert np.allclose(body.samples.vertices, organ.scene_vertices * 0.1)
    longest = np.ptp(body.samples.vertices @ organ.T_scene_ct.rotation, axis=0).max()
    assert longest == pytest.approx(0.12, rel=0.1)
    assert body.name == "ellipsoid" and body.tissue.name == "generic"


def test_steps_use_one_blas_thread_and_give_the_others_back(monkeypatch):
    counts, simulation = [], poking()

    def blas_threads():
        return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

    def counting_step(*arguments, **options):
        counts.append(blas_threads())
        return step(*arguments, **options)

    monkeypatch.setattr(session, "step", counting_step)
    with threadpool_limits(2, "blas"):
        before = blas_threads()
        simulation.step((pose(1),))
        with pytest.raises(InputError):
            simulation.step(())
        assert blas_threads() == before
    assert counts == [{1}, {1}]
