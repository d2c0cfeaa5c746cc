"""Contact shapes and meshes of the PSM's instruments, and tools with a wrist in the simulator's own terms."""

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation
from simulation_examples import BOTTOM, box_body

from organphys.ground.checks import InputError
from organphys.simulation.continuous_check import substeps
from organphys.simulation.psm import INSTRUMENTS, Psm, default_trocar
from organphys.simulation.psm_meshes import MESH_COLOURS, link_meshes
from organphys.simulation.psm_solids import signed_volume
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import ToolPose
from organphys.simulation.tool_shapes import Capsule
from organphys.simulation.tools import Part, Tool, between, checked_pose, place

EVERY = pytest.mark.parametrize("name", list(INSTRUMENTS))
BENT = np.array([0.3, -0.2, 0.1, 0.7, 0.6, -0.5])


def arm(name: str = "large_needle_driver") -> Psm:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_rotvec([0.2, 0.5, -0.3]).as_matrix()
    pose[:3, 3] = [0.02, 0.01, 0.2]
    return Psm(INSTRUMENTS[name], pose)


@EVERY
def test_the_shaft_goes_through_the_trocar_and_the_wrist_joins_shaft_and_jaws(name):
    psm = arm(name)
    tool = psm.tool()
    for joints in (psm.home, BENT, np.array([-0.5, 0.4, 0.2, -2.0, -1.0, 1.1])):
        pose = psm.forward(joints, 20.0)
        left, right, wrist, shaft = place(tool, pose)
        ends = [part.to_scene(np.stack([part.shape.start, part.shape.end])) for part in (left, right, wrist, shaft)]
        along = ends[3][1] - ends[3][0]
        beside = np.cross(along / np.linalg.norm(along), psm.rcm - ends[3][0])
        assert np.linalg.norm(beside) < 1e-9  # the trocar is on the shaft's axis
        assert np.linalg.norm(ends[3][1] - psm.rcm) <= psm.instrument.insertion and along @ (psm.rcm - ends[3][0]) > 0
        assert np.linalg.norm(ends[2][1] - pose.position) < 1e-12  # the wrist ends at the hinge
        assert np.linalg.norm(ends[2][0] - psm.rcm) == pytest.approx(abs(joints[2] - 0.0156), abs=1e-9)
        tips = [ends[k][1] + psm.instrument.jaw_radius * pose.rotation[:, 2] for k in (0, 1)]
        assert np.linalg.norm(tips[0] - tips[1]) > 0.003
        assert (tips[0] - tips[1]) @ pose.rotation[:, 1] > 0  # they open across the hinge
    assert tool.jaws is not None and tool.jaws.length == psm.instrument.jaw_length


def test_without_a_shaft_rotation_the_wrist_is_straight():
    psm = arm()
    straight = psm.forward(psm.home, 10.0)
    plain = place(psm.tool(), ToolPose(straight.position, straight.rotation, 10.0))
    for a, b in zip(plain, place(psm.tool(), straight), strict=True):
        assert np.allclose(a.position, b.position, atol=1e-12) and np.allclose(a.rotation, b.rotation, atol=1e-12)


def test_between_two_poses_the_shaft_stays_near_the_trocar_and_the_wrist_whole():
    psm = arm()
    start, end = (
        psm.forward(BENT, 40.0),
        psm.forward(BENT + np.array([0.01, -0.01, 0.002, 0.03, 0.03, 0.03]), 20.0),
    )  # one frame
    for fraction in (0.25, 0.5, 0.75):
        pose = checked_pose(between(start, end, fraction), "pose")
        wrist, shaft = place(psm.tool(), pose)[2:]
        assert np.allclose(wrist.rotation @ wrist.rotation.T, np.eye(3), atol=1e-12)
        beside = np.cross(shaft.rotation[:, 2], psm.rcm - shaft.position)
        assert np.linalg.norm(beside) < 5e-5
    assert between(gripper_pose(), gripper_pose(), 0.5).shaft_rotation is None


def gripper_pose() -> ToolPose:
    return ToolPose(np.zeros(3))


def test_a_shaft_that_swings_is_cut_into_steps_though_the_jaws_stay():
    psm = arm()
    pose = psm.forward(psm.home, 0.0)
    swung = Rotation.from_rotvec(0.3 * pose.rotation[:, 1]).as_matrix() @ pose.rotation
    moved = ToolPose(pose.position, pose.rotation, 0.0, swung)
    assert substeps(psm.tool(), pose, pose) == 1 and substeps(psm.tool(), pose, moved) > 10


def test_bad_shafts_and_links_are_refused():
    pose = arm().forward(BENT, 0.0)
    for shaft in (np.full((3, 3), np.nan), np.diag([1.0, 1, -1]), pose.shaft_rotation[:, [1, 2, 0]]):
        with pytest.raises(InputError, match="shaft_rotation"):
            checked_pose(ToolPose(pose.position, pose.rotation, 0.0, shaft), "pose of the arm")
    capsule = Capsule(np.zeros(3), np.array([0, 0, 0.01]), 0.002)
    with pytest.raises(InputError, match="link"):
        Tool((Part(capsule, link="shaft"),))
    with pytest.raises(InputError, match="jaw"):
        Tool((Part(capsule, 1, "shaft"),), wrist_length=0.01)


@EVERY
def test_meshes_are_closed_outward_and_small(name):
    psm = arm(name)
    meshes = psm.meshes(BENT, 40.0)
    assert [mesh.name for mesh in meshes] == list(MESH_COLOURS)
    assert sum(len(mesh.triangles) for mesh in meshes) <= 5000
    for mesh in meshes:
        edges = np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]])
        keys = {tuple(edge) for edge in edges.tolist()}
        assert len(keys) == len(edges)  # every directed edge once
        assert all((b, a) in keys for a, b in keys)  # and once the other way round
        assert np.isfinite(mesh.vertices).all() and mesh.triangles.max() == len(mesh.vertices) - 1
        for piece in pieces(mesh.triangles, len(mesh.vertices)):
            assert signed_volume(mesh.vertices, piece) > 1e-11


def pieces(triangles: np.ndarray, count: int) -> list[np.ndarray]:
    """The connected pieces of a surface."""
    rows = np.concatenate([triangles[:, 0], triangles[:, 1]])
    columns = np.concatenate([triangles[:, 1], triangles[:, 2]])
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), (count, count))
    label = connected_components(graph, directed=False)[1]
    return [triangles[label[triangles[:, 0]] == k] for k in range(label.max() + 1)]


@EVERY
def test_meshes_stand_where_the_contact_shapes_are(name):
    psm = arm(name)
    pose = psm.forward(BENT, 30.0)
    meshes = {mesh.name: mesh.vertices for mesh in psm.meshes(BENT, 30.0)}
    left, right, wrist, shaft = place(psm.tool(), pose)
    assert shaft.gap_and_normal(meshes["shaft"])[0].max() < psm.instrument.insertion
    inside = meshes["shaft"][np.linalg.norm(meshes["shaft"] - pose.position, axis=1) < 0.05]
    assert -5e-4 < shaft.gap_and_normal(inside)[0].max() < 5e-4
    assert wrist.gap_and_normal(meshes["wrist"])[0].max() < 0.003
    for part, jaw in ((left, "jaw_left"), (right, "jaw_right")):
        assert part.gap_and_normal(meshes[jaw])[0].max() < 0.003
        middle = part.to_local(meshes[jaw]).mean(0)
        assert abs(middle[1]) > 5e-4 and np.sign(middle[1]) == np.sign(part.shape.start[1])
    ring = meshes["trocar"] - psm.rcm
    assert np.abs(ring.mean(0)).max() < 1e-9 and np.abs(ring @ pose.shaft_rotation[:, 2]).max() < 0.003
    tip = max(np.linalg.norm(meshes[jaw] - pose.position, axis=1).max() for jaw in ("jaw_left", "jaw_right"))
    assert tip == pytest.approx(psm.instrument.jaw_length, abs=4e-4)


def test_closed_jaws_meet_and_do_not_cross():
    psm = arm()
    for jaw_deg in (0.0, -20.0):
        for name, side in (("jaw_left", 1.0), ("jaw_right", -1.0)):
            pose = psm.forward(BENT, jaw_deg)
            mesh = {m.name: m.vertices for m in psm.meshes(BENT, jaw_deg)}[name]
            local = (mesh - pose.position) @ pose.rotation
            assert (side * local[local[:, 2] > 0.003, 1]).min() > 0
    first = link_meshes(psm.instrument)
    assert first is link_meshes(psm.instrument)


def test_an_arm_grasps_and_lifts_in_the_simulator():
    body = box_body(BOTTOM)
    top = np.array([*body.samples.points[:, :2].mean(0), body.samples.points[:, 2].max()])
    frame = np.eye(4)
    frame[:3, 3] = top + np.array([0, 0, 0.12])
    psm = Psm(INSTRUMENTS["large_needle_driver"], frame)
    down = np.diag([1.0, -1.0, -1.0])

    def pose(height: float, jaw_deg: float) -> ToolPose:
        solution = psm.inverse(ToolPose(top + np.array([0, 0, height]), down, jaw_deg), near=psm.home)
        assert solution.limits == ()
        return solution.pose

    scene = Scene((body,), (psm.tool(),))
    simulation = Simulation(scene, scene.initial_state(pose(0.02, 60)))
    half = psm.instrument.jaw_length / 2
    for height, jaw_deg in [*zip(np.linspace(0.02, half, 8), [60] * 8, strict=True), (half, 30), (half, 5)]:
        simulation.step((pose(height, jaw_deg),), dt=1 / 60)
    assert simulation.state.bodies[0].grips[0].closed and len(simulation.state.bodies[0].grips[0].sample)
    for height in np.linspace(half, half + 0.015, 20):
        report = simulation.step((pose(height, 5),), dt=1 / 60)
    assert report.forces[0].force[2] < -0.01  # the tissue pulls the tool down


def test_two_arms_stretch_an_organ_between_them():
    body = box_body(BOTTOM)
    centre, top = body.samples.points.mean(0), body.samples.points[:, 2].max()
    camera = centre + np.array([0, 0, 0.15])
    arms, spots = [], []
    for side, sign, name in (("right", 1, "prograsp"), ("left", -1, "large_needle_driver")):
        row = INSTRUMENTS[name]
        arms.append(Psm(row, default_trocar(body.samples.points, camera=camera, side=side, instrument=row)))
        spots.append(np.array([centre[0] + sign * 0.025, centre[1], top]))
    down = np.diag([1.0, -1.0, -1.0])

    def poses(height: float, apart: float, jaw_deg: float) -> tuple[ToolPose, ...]:
        out = []
        for psm, spot, sign in zip(arms, spots, (1, -1), strict=True):
            hinge = spot + np.array([sign * apart, 0, height + psm.instrument.jaw_length / 2])
            solution = psm.inverse(ToolPose(hinge, down, jaw_deg))
            assert solution.limits == ()
            out.append(solution.pose)
        return tuple(out)

    scene = Scene((body,), tuple(psm.tool() for psm in arms))
    simulation = Simulation(scene, scene.initial_state(*poses(0.01, 0, 60)))
    for height, jaw_deg in ((0.006, 60), (0.003, 60), (0.0, 60), (0.0, 30), (0.0, 5)):
        simulation.step(poses(height, 0.0, jaw_deg), dt=1 / 60)
    for apart in np.linspace(0, 0.006, 6):
        report = simulation.step(poses(0.004, apart, 5), dt=1 / 60)
    assert all(len(grip.sample) for grip in simulation.state.bodies[0].grips)
    assert report.forces[0].force[0] < -0.01 and report.forces[1].force[0] > 0.01  # each is pulled to the other
