"""Trajectories: files there and back, interpolation, frames and units, bad input, and an arm that follows them."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from organphys.exports.trajectory_file import write_trajectory
from organphys.ground.checks import InputError
from organphys.ground.frames import Similarity
from organphys.points.trajectory import Trajectory, rotation_along
from organphys.readers.trajectory_file import read_trajectory
from organphys.simulation.psm import INSTRUMENTS, Psm
from organphys.simulation.psm_trajectory import reachable, tip_trajectory, tool_poses

COUNT = 6
TURN = Rotation.random(random_state=5).as_matrix()


def example(frame: str = "scene", unit: str = "mm") -> Trajectory:
    rng = np.random.default_rng(0)
    times = np.cumsum(rng.uniform(0.05, 0.5, COUNT))
    turns = Rotation.from_rotvec(rng.normal(size=(COUNT, 3)) * 0.4) * Rotation.from_matrix(TURN)
    return Trajectory(times, rng.normal(size=(COUNT, 3)), turns.as_matrix(), rng.uniform(0, 60, COUNT), frame, unit)


@pytest.mark.parametrize("kind", [".csv", ".json"])
@pytest.mark.parametrize(("frame", "unit"), [("scene", "scene"), ("scene", "cm"), ("ct", "mm"), ("m", "m")])
def test_what_is_written_is_read(tmp_path, kind, frame, unit):
    before, path = example(frame, unit), tmp_path / f"t{kind}"
    write_trajectory(path, before)
    after = read_trajectory(path)
    assert (after.frame, after.unit) == (frame, unit)
    assert np.array_equal(after.times, before.times) and np.array_equal(after.positions, before.positions)
    assert np.array_equal(after.jaw_deg, before.jaw_deg) and np.allclose(after.rotations, before.rotations, atol=1e-14)


def test_files_by_hand_with_direction_and_roll(tmp_path):
    text = "# frame: m\n# unit: mm\n\ntime_s, x,y,z, dx,dy,dz, roll_deg\n0,1,2,3,0,0,2,0\n0.5,1,2,4,0,1,0,90\n"
    (tmp_path / "t.csv").write_text(text)
    one = read_trajectory(tmp_path / "t.csv")
    assert one.unit == "mm" and not one.jaw_deg.any() and np.allclose(one.rotations[0], np.eye(3))
    assert np.allclose(one.rotations[1][:, 2], [0, 1, 0])
    assert np.allclose(one.rotations[1], rotation_along(np.array([0.0, 1, 0]), 90.0))
    assert np.allclose(rotation_along(np.array([0.0, 1, 0]), 0.0)[:, 0], [1, 0, 0])
    poses = [
        {"time_s": 0, "position": [1, 2, 3], "direction": [0, 0, 2]},
        {"time_s": 0.5, "position": [1, 2, 4], "direction": [0, 1, 0], "roll_deg": 90, "jaw_deg": 0},
    ]
    content = {"format": "organphys-trajectory", "version": 1, "frame": "m", "unit": "mm", "poses": poses}
    (tmp_path / "t.json").write_text(json.dumps(content))
    two = read_trajectory(tmp_path / "t.json")
    assert np.array_equal(one.positions, two.positions) and np.allclose(one.rotations, two.rotations)


def test_lps_axes_are_turned_to_ras(tmp_path):
    text = "# frame: ct\n# axes: LPS\ntime_s,x,y,z,dx,dy,dz\n0,10,20,30,0.6,0.8,0\n"
    (tmp_path / "t.csv").write_text(text)
    trajectory = read_trajectory(tmp_path / "t.csv")
    assert np.allclose(trajectory.positions, [[-10, -20, 30]]) and trajectory.unit == "mm"
    assert np.allclose(trajectory.rotations[0][:, 2], [-0.6, -0.8, 0])


def test_between_poses_it_is_straight_and_turns_evenly():
    trajectory = example()
    a, b = 2, 3
    middle = trajectory.at(trajectory.times[[a, b]].mean())
    assert np.allclose(middle.position, trajectory.positions[[a, b]].mean(0))
    assert middle.jaw_deg == pytest.approx(trajectory.jaw_deg[[a, b]].mean())
    half = Rotation.from_matrix(trajectory.rotations[b] @ trajectory.rotations[a].T).as_rotvec() / 2
    assert np.allclose(middle.rotation, Rotation.from_rotvec(half).as_matrix() @ trajectory.rotations[a])
    for k in (0, 4):
        assert np.allclose(trajectory.at(trajectory.times[k]).rotation, trajectory.rotations[k])
    assert np.array_equal(trajectory.at(-5.0).position, trajectory.positions[0])
    assert np.array_equal(trajectory.at(1e6).position, trajectory.positions[-1])
    slerp = Slerp(trajectory.times, Rotation.from_matrix(trajectory.rotations))
    for time in np.linspace(trajectory.times[0], trajectory.times[-1], 33):
        assert np.allclose(trajectory.at(time).rotation, slerp(time).as_matrix(), atol=1e-12)
    many = trajectory.resampled(np.linspace(trajectory.times[0], trajectory.times[-1], 40))
    assert len(many) == 40 and many.duration == pytest.approx(trajectory.duration)
    still = Trajectory([0.0], [[1.0, 2, 3]], [np.eye(3)], [5.0])
    assert np.array_equal(still.at(3.0).position, [1, 2, 3])
    with pytest.raises(InputError, match="finite"):
        trajectory.at(np.nan)


def test_every_frame_and_unit_comes_to_the_same_metres():
    T_sim_scene = Similarity(0.02, np.eye(3), np.zeros(3))  # a scene unit is 20 mm
    T_scene_ct = Similarity(0.05, TURN, np.array([1.0, 2, 3]))
    T_sim_ct = T_sim_scene @ T_scene_ct  # 1 mm of CT is 1 mm
    metres = example("m", "m")

    def same(trajectory: Trajectory) -> None:
        result = trajectory.in_metres(T_sim_scene, T_sim_ct)
        assert (result.frame, result.unit) == ("m", "m")
        assert np.allclose(result.positions, metres.positions, atol=1e-12)
        assert np.allclose(result.rotations, metres.rotations, atol=1e-12)

    rest = (metres.rotations, metres.jaw_deg)
    same(Trajectory(metres.times, 100 * metres.positions, *rest, "m", "cm"))
    same(Trajectory(metres.times, 50 * metres.positions, *rest, "scene", "scene"))
    same(Trajectory(metres.times, 1000 * metres.positions, *rest, "scene", "mm"))
    back = T_sim_ct.inverse()
    turned = (back.rotation @ metres.rotations, metres.jaw_deg)
    same(Trajectory(metres.times, back.apply(metres.positions), *turned, "ct"))
    same(Trajectory(metres.times, back.apply(metres.positions) / 10, *turned, "ct", "cm"))
    with pytest.raises(InputError, match="frame 'ct'"):
        example("ct").in_metres(T_sim_scene)


def test_bad_trajectories_are_refused():
    good = example()
    rows = {"times": good.times, "positions": good.positions, "rotations": good.rotations, "jaw_deg": good.jaw_deg}
    nan, flat = good.positions.copy(), good.times.copy()
    nan[1, 1], flat[3] = np.nan, flat[2]
    for change, message in (
        ({"positions": nan}, "not finite"),
        ({"times": flat}, "must rise, pose 4"),
        ({"times": good.times[:-1]}, "times"),
        ({"jaw_deg": np.full(COUNT, np.inf)}, "jaw_deg"),
        ({"jaw_deg": np.full(COUNT, 900.0)}, "jaw_deg"),
        ({"rotations": 2 * good.rotations}, "proper rotation"),
        ({"rotations": good.rotations * [1, 1, -1]}, "proper rotation"),
        ({"rotations": good.rotations[0]}, "rotations"),
        ({"frame": "world"}, "frame"),
        ({"unit": "inch"}, "unit"),
        ({"frame": "ct", "unit": "scene"}, "unit"),
    ):
        with pytest.raises(InputError, match=message):
            Trajectory(**{**rows, **change})


HEAD = "# frame: m\n# unit: mm\n"
ROW = "time_s,x,y,z,qw,qx,qy,qz\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("t.txt", "", "unknown kind"),
        ("t.csv", "", "no poses"),
        ("t.csv", HEAD + ROW, "no poses"),
        ("t.csv", ROW + "0,1,2,3,1,0,0,0\n", "frame is not stated"),
        ("t.csv", "# frame: m\n# unit: inch\n" + ROW + "0,1,2,3,1,0,0,0\n", "unit"),
        ("t.csv", HEAD + "time_s,x,y,z\n0,1,2,3\n", "rotation"),
        ("t.csv", HEAD + "t,x,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n", "'t' is unknown"),
        ("t.csv", HEAD + "time_s,y,z,qw,qx,qy,qz\n0,2,3,1,0,0,0\n", "no x"),
        ("t.csv", HEAD + ROW + "0,1,2,3,1,0,0\n", "line 4"),
        ("t.csv", HEAD + ROW + "0,1,2,three,1,0,0,0\n", "line 4"),
        ("t.csv", HEAD + ROW + "0,1,2,nan,1,0,0,0\n", "not finite"),
        ("t.csv", HEAD + ROW + "0,1,2,3,5,0,0,0\n", "length 5"),
        ("t.csv", HEAD + ROW + "0,1,2,3,1,0,0,0\n0,1,2,3,1,0,0,0\n", "must rise"),
        ("t.csv", HEAD + "# axes: LPS\n" + ROW + "0,1,2,3,1,0,0,0\n", "axes"),
        ("t.csv", HEAD + "time_s,x,y,z,dx,dy,dz\n0,1,2,3,0,0,0\n", "no length"),
        ("t.csv", HEAD + ROW + '"' + 200_000 * "1" + '"\n', "too long"),
        ("t.json", "[]", "no trajectory"),
        ("t.json", '{"format": "organphys-trajectory", "version": 2}', "no trajectory"),
    ],
)
def test_bad_files_are_refused_with_what_to_do(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_trajectory(tmp_path / name)
    assert name in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ({"time_s": 0, "position": [0, 0], "quaternion": [1, 0, 0, 0]}, "position"),
        ({"time_s": 0, "position": [0, 0, 10**400], "quaternion": [1, 0, 0, 0]}, "too long|position"),
        ({"time_s": None, "position": [0, 0, 0], "quaternion": [1, 0, 0, 0]}, "numbers"),
        ({"time_s": 0, "position": [0, 0, 0], "quaternion": [1, 0, 0]}, "quaternion"),
        ({"time_s": 0, "position": [0, 0, 0]}, "quaternion"),
        ({"time_s": 0, "position": [0, 0, 0], "direction": "down"}, "direction"),
        ("up", "list"),
    ],
)
def test_bad_poses_in_json_are_named(tmp_path, pose, message):
    content = {"format": "organphys-trajectory", "version": 1, "frame": "m", "poses": [pose]}
    (tmp_path / "t.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=message):
        read_trajectory(tmp_path / "t.json")


def straight_down(depths: np.ndarray, jaw_deg: float = 30.0) -> Trajectory:
    """The tip on the axis below a trocar at the origin, in metres."""
    count = len(depths)
    rotations = np.tile(np.diag([1.0, -1.0, -1.0]), (count, 1, 1))
    positions = np.stack([np.zeros(count), np.zeros(count), -depths], axis=1)
    return Trajectory(np.arange(count) / 10, positions, rotations, np.full(count, jaw_deg))


def test_an_arm_follows_a_trajectory_with_the_tip():
    psm = Psm(INSTRUMENTS["large_needle_driver"], np.eye(4))
    trajectory = straight_down(np.linspace(0.08, 0.2, 13))
    reach = reachable(psm, trajectory)
    assert not reach.clamped.any() and not reach.near_trocar.any() and reach.notices() == ()
    for pose, tip in zip(reach.poses, trajectory.positions, strict=True):
        assert np.allclose(pose.position + 0.0102 * pose.rotation[:, 2], tip, atol=1e-12)
        assert pose.shaft_rotation is not None and pose.jaw_deg == 30.0
    plain = tool_poses(trajectory, 0.0102)
    assert np.allclose([p.position for p in plain], [p.position for p in reach.poses])
    again = tip_trajectory(trajectory.times, reach.poses, 0.0102)
    assert np.allclose(again.positions, trajectory.positions, atol=1e-12) and again.frame == "m"
    with pytest.raises(InputError, match="in_metres"):
        reachable(psm, example("scene"))


def test_what_is_out_of_reach_is_clamped_and_told():
    psm = Psm(INSTRUMENTS["large_needle_driver"], np.eye(4))
    reach = reachable(psm, straight_down(np.linspace(0.18, 0.28, 11), jaw_deg=95.0))
    deepest = 0.24 - 0.0156 + 0.0091 + 0.0102
    beyond = np.linspace(0.18, 0.28, 11) > deepest
    assert [("insertion" in reach.limits(k)) for k in range(11)] == beyond.tolist()
    assert all("jaw" in reach.limits(k) for k in range(11)) and {p.jaw_deg for p in reach.poses} == {80.0}
    assert reach.path.position_error_m[-1] == pytest.approx(0.28 - deepest)
    (notice,) = reach.notices()
    assert notice.code == "psm_limits" and "insertion, jaw" in notice.message and "11 of 11" in notice.message
    near = reachable(psm, straight_down(np.array([0.0193 + 0.002])))
    assert [n.code for n in near.notices()] == ["psm_singular"]
