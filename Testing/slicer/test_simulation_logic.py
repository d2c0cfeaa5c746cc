"""The simulation scripted: grasp and lift, splat, files, pins, undo, bad input; and nothing is left behind."""

from __future__ import annotations

import json
import re
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
import slicer
from PIL import Image
from simulation_example import FINENESS

from organphys.exports.recording_file import load_recording
from organphys.ground.checks import InputError
from organphys.pipeline.command_line import main
from organphys.readers.gaussian_ply import read_gaussians
from OrganPhysRegistrationLib.inputs.camera_input import look_from_endoscope
from OrganPhysRegistrationLib.inputs.splat_node import load_splat
from OrganPhysSimulationLib.logic import OrganPhysSimulationLogic
from OrganPhysSimulationLib.outputs.recorder import frame_count, recordings, show_frame
from OrganPhysSimulationLib.roles import ROLE, find
from OrganPhysSimulationLib.views import gaussian_actor


@pytest.fixture
def logic(scene):
    made = OrganPhysSimulationLogic()
    made.fineness = dict(FINENESS)
    yield made
    made.cleanup()


@pytest.fixture
def nodes(logic, simulation_files):
    """organ, splat, and one pin at the back of the organ."""
    pins = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", "pins")
    pins.AddControlPointWorld(0, 175, 0)
    return logic.loadOrgan(simulation_files.asset), load_splat(simulation_files.splat, mm_per_unit=100), pins


@pytest.fixture
def session(logic, nodes):
    organ, splat, pins = nodes
    return logic.startSimulation(organ, splat, pinsNode=pins)


def test_grasp_and_lift_carries_surface_and_splat(logic, session, view_png):
    away, touched = session.live.arm.joints.copy(), session.live.joints_at_contact()
    rest = session.splat_view.cloud.positions.copy()
    session.show_splat(True)
    logic.setJoints(touched, jawDeg=30)
    pushed = logic.step(25)
    assert pushed.contacts > 0
    assert 0.1 < pushed.force_n < 50
    logic.setJoints(touched, jawDeg=-10)
    assert logic.step(20).held > 0
    logic.setJoints(away, jawDeg=-10)
    lifted = logic.step(20)
    assert lifted.held > 0
    assert lifted.min_det > 0
    assert lifted.deepest_mm < 0.3
    moved = np.linalg.norm(session.splat_view.cloud.positions - rest, axis=1)
    most = 1e3 * np.linalg.norm(session.live.displacement(), axis=1).max()  # mm
    assert most > 2
    assert moved.max() == pytest.approx(most, rel=0.3)
    assert moved[-500:].max() == 0  # the wall behind the organ stays
    view = slicer.app.layoutManager().threeDWidget(0)
    view.view.window.SetSize(300, 220)
    look_from_endoscope(session.splat, view.mrmlViewNode())
    picture = np.asarray(Image.open(view_png("simulation_splat", fit=False)).convert("RGB")).astype(int)
    red = (picture[..., 0] > picture[..., 2] + 60).mean()
    assert 0.05 < red < 0.6  # the organ's Gaussians are drawn, before those of the wall


@pytest.mark.parametrize("kind", ["points", "balls", "ellipsoids"])
def test_the_splat_is_drawn_with_what_vtk_has(logic, session, view_png, monkeypatch, kind):
    monkeypatch.setattr(gaussian_actor, "drawn_as", lambda: kind)
    session.show_splat(True)
    view = slicer.app.layoutManager().threeDWidget(0)
    view.view.window.SetSize(300, 220)
    look_from_endoscope(session.splat, view.mrmlViewNode())
    picture = np.asarray(Image.open(view_png(f"simulation_{kind}", fit=False)).convert("RGB")).astype(int)
    assert 0.03 < (picture[..., 0] > picture[..., 2] + 60).mean() < 0.6


def test_undo_and_reset_go_back(logic, session):
    logic.setJoints(session.live.joints_at_contact(), jawDeg=30)
    logic.step(15)
    before, time_s = session.live.displacement(), session.live.time_s
    session.live.mark()
    logic.step(5)
    logic.undo()
    assert session.live.time_s == time_s
    assert np.array_equal(session.live.displacement(), before)
    with pytest.raises(InputError, match="nothing to undo"):
        logic.undo()
    logic.reset()
    assert session.live.time_s == 0
    assert np.abs(session.live.displacement()).max() == 0


def test_dragged_handle_moves_the_tool(logic, session):
    handle = session.tool.handle
    session.place_handle()
    start = session.live.pose.position
    matrix = slicer.util.arrayFromTransformMatrix(handle)
    matrix[:3, 3] += [0, 10, 0]
    slicer.util.updateTransformMatrixFromArray(handle, matrix)
    logic.step(20)
    assert 1e3 * (session.live.pose.position - start) == pytest.approx([0, 10, 0], abs=0.05)  # mm
    matrix[:3, 3] += [0, 0, 2000]
    slicer.util.updateTransformMatrixFromArray(handle, matrix)
    logic.step(1)
    assert "insertion" in session.live.limits


def test_pins_hold_and_can_be_changed(logic, nodes, session):
    pins = nodes[2]
    logic.setGravity((0, 1, 0))
    assert logic.warnings() == []
    logic.step(10)
    pins.RemoveAllControlPoints()
    logic.setPins(pins)
    assert any("no pins" in text for text in logic.warnings())
    fallen = session.live.body.centre_of_mass(session.live.z)[1]
    logic.step(10)
    assert session.live.body.centre_of_mass(session.live.z)[1] > fallen + 1e-3  # m
    box = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsROINode", "box")
    box.SetCenterWorld(-50, 150, 0)
    box.SetSizeWorld(30, 60, 60)
    logic.setPins(None, box)
    held = session.live.body.held_points  # m along the scene's axes
    (pin,) = session.pins
    assert pin.distances(held).max() == 0 and pin.sides == pytest.approx((0.03, 0.06, 0.06))
    inside = [pin.distances(part) == 0 for part in (session.live.body.shape.points, session.live.body.samples.points)]
    assert len(held) == sum(int(part.sum()) for part in inside)  # all tissue in the box, and no other
    assert logic.warnings() == []
    box.SetCenterWorld(500, 0, 0)
    with pytest.raises(InputError, match="no tissue in it"):
        logic.setPins(None, box)
    assert len(session.pins) >= 1


def test_stiffer_tissue_resists_more(logic, session):
    logic.setJoints(session.live.joints_at_contact(), jawDeg=30)
    soft = logic.step(40).force_n
    logic.setTissue("liver", 20.0)
    assert logic.step(40).force_n > 1.5 * soft
    with pytest.raises(InputError, match="tissue: expected one of"):
        logic.setTissue("stone")


def test_files(logic, session, simulation_files, tmp_path):
    with pytest.raises(InputError, match="nothing was simulated"):
        logic.export("recording", tmp_path / "r.npz")
    logic.setJoints(session.live.joints_at_contact(), jawDeg=30)
    logic.step(25)
    for name in ("a.stl", "a.ply", "a.vtp"):
        logic.export("surface", tmp_path / name)
        assert (tmp_path / name).stat().st_size > 10_000
    model = slicer.util.loadModel(str(tmp_path / "a.vtp"))
    shown = slicer.util.arrayFromModelPoints(session.surface.node).astype(float)
    world = shown @ session.T_world_sim[:3, :3].T + session.T_world_sim[:3, 3]
    assert np.abs(slicer.util.arrayFromModelPoints(model) - world).max() < 1e-2  # mm
    logic.export("splat", tmp_path / "s.ply")
    before, after = read_gaussians(simulation_files.splat), read_gaussians(tmp_path / "s.ply")
    moved = np.linalg.norm(after.means - before.means, axis=1)
    assert len(after) == len(before)
    assert moved.max() > 0.02  # scene units, 2 mm
    assert moved[-500:].max() == 0
    logic.export("recording", tmp_path / "r.npz")
    assert len(load_recording(tmp_path / "r.npz").events) == 25
    for what, name in (("surface", "a.txt"), ("splat", "s.txt"), ("recording", "r.txt"), ("film", "f.mp4")):
        with pytest.raises(InputError):
            logic.export(what, tmp_path / name)


def test_the_whole_sequence_is_written_as_the_command_does(logic, session, simulation_files, tmp_path):
    with pytest.raises(InputError, match="nothing was simulated"):
        logic.export("sequence", tmp_path / "none")
    logic.setJoints(session.live.joints_at_contact(), jawDeg=30)
    logic.step(25)
    recording, here, there = tmp_path / "r.npz", tmp_path / "here", tmp_path / "there"
    logic.export("recording", recording)
    assert logic.export("sequence", here) == str(here)
    command = ["export", simulation_files.asset, "--format", "splat", "--splat", simulation_files.splat, "--at", "all"]
    assert main([str(word) for word in [*command, "--recording", recording, "--quiet", "--out", there]]) == 0
    names = [f"splat_{k:05d}.ply" for k in range(26)]
    assert sorted(path.name for path in here.iterdir()) == names
    assert all((here / name).read_bytes() == (there / name).read_bytes() for name in names)
    moved = read_gaussians(here / names[-1]).means - read_gaussians(simulation_files.splat).means
    assert np.linalg.norm(moved, axis=1).max() > 0.02  # scene units, 2 mm


def test_trajectory_is_followed_and_its_limits_are_told(logic, session, tmp_path):
    tip = session.live.pose.position + session.live.pose.rotation[:, 2] * session.live.psm.instrument.jaw_length
    rows = [
        {"time_s": t, "position": (1e3 * (tip + np.array([0, 0.02 * t, 0]))).tolist(), "direction": d, "jaw_deg": 20}
        for t, d in ((0, session.live.pose.rotation[:, 2].tolist()), (1, session.live.pose.rotation[:, 2].tolist()))
    ]
    record = {"format": "organphys-trajectory", "version": 1, "frame": "m", "unit": "mm", "poses": rows}
    (tmp_path / "t.json").write_text(json.dumps(record))
    assert logic.followTrajectory(tmp_path / "t.json") == []
    logic.step(62)
    live = session.live
    reached = live.pose.position + live.pose.rotation[:, 2] * live.psm.instrument.jaw_length
    assert 1e3 * (reached - tip) == pytest.approx([0, 20, 0], abs=0.5)  # mm
    assert session.path is None  # it is over
    rows[1]["position"] = [0, 0, 5000]
    (tmp_path / "t.json").write_text(json.dumps(record))
    assert any("beyond a limit" in text for text in logic.followTrajectory(tmp_path / "t.json"))
    with pytest.raises(InputError, match="unknown kind"):
        logic.followTrajectory(tmp_path / "t.txt")


def test_recording_plays_back_with_the_splat(logic, session):
    logic.startRecording()
    logic.setJoints(session.live.joints_at_contact(), jawDeg=30)
    for _ in range(12):
        logic.step(3)
    last = slicer.util.arrayFromModelPoints(session.surface.node).copy()
    browser = logic.stopRecording()
    assert recordings() == [browser]
    assert frame_count(browser) == 13
    show_frame(browser, 0)
    assert np.abs(slicer.util.arrayFromModelPoints(session.surface.node) - last).max() > 1  # mm
    show_frame(browser, 12)
    assert np.array_equal(slicer.util.arrayFromModelPoints(session.surface.node), last)
    session.show_recorded()
    logic.startRecording()
    logic.closeSimulation()
    assert browser.GetScene() is not None


def test_start_and_stop_200_times_leaves_nothing_behind(host, logic, session, scene_contents):
    session.show_splat(True)
    before, observers = scene_contents(), slicer.mrmlScene.GetNumberOfNodes()
    state = session.live.z.copy()
    for _ in range(200):
        logic.run()
        logic.pause()
    host.process()
    assert not logic.running
    assert scene_contents() == before
    assert slicer.mrmlScene.GetNumberOfNodes() == observers
    assert np.abs(session.live.z - state).max() < 1e-9
    stepped = session.live.time_s
    host.wait(0.1)
    assert session.live.time_s == stepped


def test_a_closed_simulation_leaves_scene_and_views_as_they_were(host, logic, nodes, scene_contents):
    organ, splat, pins = nodes
    renderer = slicer.app.layoutManager().threeDWidget(0).view.renderer
    before, props = scene_contents(), renderer.GetViewProps().GetNumberOfItems()
    for _ in range(2):
        session = logic.startSimulation(organ, splat, pinsNode=pins)
        session.show_splat(True)
        logic.setGravity((0, 1, 0))
        logic.step(2)
        logic.closeSimulation()
        host.process()
    left = {line for line in scene_contents() - before if "scene to world" not in line}
    assert left == set()
    assert renderer.GetViewProps().GetNumberOfItems() == props
    assert splat.GetDisplayNode().GetVisibility() == 1


def test_bad_input_is_told_and_changes_nothing(logic, nodes, simulation_files, tmp_path, scene_contents):
    organ, splat, pins = nodes
    before = scene_contents()
    newer = tmp_path / "newer.organphys"
    with zipfile.ZipFile(simulation_files.asset) as old, zipfile.ZipFile(newer, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "organ.json":
                content = json.dumps(json.loads(content) | {"version": 99}).encode()
            new.writestr(name, content)
    with pytest.raises(InputError, match="version 99 is newer"):
        logic.loadOrgan(newer)
    with pytest.raises(InputError, match="cannot be read"):
        logic.loadOrgan(tmp_path / "none.organphys")
    with pytest.raises(InputError, match="none chosen"):
        logic.startSimulation(None)
    with pytest.raises(InputError, match="carries no registered organ"):
        logic.startSimulation(splat)
    with pytest.raises(InputError, match="none is prepared"):
        logic.step()
    pins.SetNthControlPointPositionWorld(0, 900, 0, 0)
    with pytest.raises(InputError, match="no tissue within"):
        logic.startSimulation(organ, splat, pinsNode=pins)
    assert scene_contents() == before


def test_nan_poses_are_refused_and_a_tool_inside_is_pushed_out(logic, session):
    before = session.live.z.copy()
    with pytest.raises(InputError, match="finite"):
        logic.setJoints([np.nan] * 6, jawDeg=0)
    assert np.array_equal(session.live.z, before)
    joints = session.live.joints_at_contact(depth=0.012)
    session.live.arm = session.live.wanted = type(session.live.arm)(joints, 20.0)  # starts inside the organ
    reading = logic.step(30)
    assert reading.min_det > 0
    assert reading.force_n < 100


def test_console_example_of_the_documentation_runs(logic, simulation, simulation_files, tmp_path, monkeypatch, capsys):
    page = (Path(__file__).parents[2] / "Resources" / "Docs" / "scripting.md").read_text(encoding="utf-8")
    (block,) = [b for b in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL) if "OrganPhysSimulation" in b]
    monkeypatch.chdir(tmp_path)
    shutil.copy(simulation_files.asset, "liver.organphys")
    names = {}
    exec(compile(block, "scripting.md", "exec"), names)
    assert (tmp_path / "pushed.stl").stat().st_size > 10_000
    assert re.search(r"[\d.]+ N, volume [+-][\d.]+ %", capsys.readouterr().out)
    assert names["reading"].contacts > 0


def test_a_saved_scene_comes_back_and_can_be_simulated_again(logic, nodes, session, tmp_path):
    logic.setJoints(session.live.joints_at_contact(), jawDeg=30)
    logic.startRecording()
    logic.step(20)
    logic.stopRecording()
    shown = slicer.util.arrayFromModelPoints(session.surface.node).copy()
    assert slicer.util.saveScene(str(tmp_path / "scene.mrb"))
    slicer.mrmlScene.Clear(0)
    assert logic.session is None
    slicer.util.loadScene(str(tmp_path / "scene.mrb"))
    surface = find("surface")
    assert np.abs(slicer.util.arrayFromModelPoints(surface) - shown).max() < 1e-3  # mm
    assert len(recordings()) == 1
    organ, splat = (slicer.util.getNode(name) for name in ("liver", "splat"))
    again = logic.startSimulation(organ, splat)
    logic.startRecording()
    logic.step(2)
    assert frame_count(logic.stopRecording()) == 2
    assert again.surface.node.GetAttribute(ROLE) == "surface"
