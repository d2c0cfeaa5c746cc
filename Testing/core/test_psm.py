"""Kinematics of the PSM: round trips, limits, the remote centre of motion, derivatives, singular places, bad input."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from organphys.ground.checks import InputError
from organphys.ground.frames import rotation_angle
from organphys.simulation.instruments import BEHIND_RCM, JOINTS, instrument_named
from organphys.simulation.psm import INSTRUMENTS, Psm, default_trocar
from organphys.simulation.psm_inverse import inverse_joints
from organphys.simulation.psm_kinematics import link_frames, links
from organphys.simulation.state import ToolPose

T_SCENE_RCM = np.eye(4)
T_SCENE_RCM[:3, :3] = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
T_SCENE_RCM[:3, 3] = [0.05, -0.12, 0.3]
EVERY = pytest.mark.parametrize("name", list(INSTRUMENTS))


def arm(name: str = "large_needle_driver") -> Psm:
    return Psm(INSTRUMENTS[name], T_SCENE_RCM)


def random_joints(psm: Psm, count: int, seed: int = 0) -> np.ndarray:
    low, high = psm.instrument.limits.T
    return np.random.default_rng(seed).uniform(low, high, (count, 6))


def by_hand(joints: np.ndarray, wrist_length: float) -> np.ndarray:
    """T_rcm_hinge by the table of the da Vinci Research Kit's user guide, one transform after the other."""
    yaw, pitch, insertion, roll, wrist_pitch, wrist_yaw = joints
    table = (
        (90, 0, yaw + np.pi / 2, 0),
        (-90, 0, pitch - np.pi / 2, 0),
        (90, 0, 0, insertion - 0.4318),
        (0, 0, roll, 0.4162),
        (-90, 0, wrist_pitch - np.pi / 2, 0),
        (-90, wrist_length, wrist_yaw - np.pi / 2, 0),
    )
    pose = np.eye(4)
    for alpha, a, theta, d in table:
        about_x, about_z = np.eye(4), np.eye(4)
        about_x[:3, :3], about_x[0, 3] = Rotation.from_euler("x", alpha, degrees=True).as_matrix(), a
        about_z[:3, :3], about_z[2, 3] = Rotation.from_euler("z", theta).as_matrix(), d
        pose = pose @ about_x @ about_z
    return pose


@EVERY
def test_forward_is_the_table(name):
    psm = arm(name)
    for joints in random_joints(psm, 20):
        expected = by_hand(joints, psm.instrument.wrist_length)
        assert np.allclose(link_frames(joints[None], psm.instrument)[0, 5], expected, atol=1e-14)
        pose = psm.forward(joints, 12.0)
        expected = T_SCENE_RCM @ expected
        assert np.allclose(pose.position, expected[:3, 3], atol=1e-14) and pose.jaw_deg == 12.0
        assert np.allclose(pose.rotation[:, 0], -expected[:3, 2], atol=1e-14)  # x along the hinge, the last axis
        assert np.allclose(pose.rotation[:, 2], expected[:3, 1], atol=1e-14)


def test_the_straight_instrument_points_along_minus_z_and_moves_as_stated():
    psm = Psm(INSTRUMENTS["large_needle_driver"], np.eye(4))
    straight = psm.forward(psm.home, 0.0)
    depth = 0.12 - BEHIND_RCM + 0.0091
    assert np.allclose(straight.position, [0, 0, -depth], atol=1e-12)
    assert np.allclose(straight.rotation[:, 2], [0, 0, -1]) and np.allclose(straight.rotation, straight.shaft_rotation)
    step = np.diag([1e-3] * 6)
    moved = [psm.forward(psm.home + step[k], 0.0) for k in range(6)]
    assert moved[0].position[0] > 1e-5 and moved[1].position[1] < -1e-5
    assert moved[2].position[2] == pytest.approx(-depth - 1e-3)


@EVERY
def test_round_trip_over_random_joints(name):
    psm = arm(name)
    joints = random_joints(psm, 3000)
    poses = psm.poses(joints, np.zeros(len(joints)))
    at = links(joints, psm.instrument)
    found, clamped = inverse_joints(at.tool_rotation, at.hinge, joints, psm.instrument)
    assert not clamped.any() and np.abs(found - joints).max() < 1e-9
    for joint, pose in list(zip(joints, poses, strict=True))[:60]:
        solution = psm.inverse(ToolPose(pose.position, pose.rotation, 33.0), near=joint)
        assert solution.limits == () and solution.jaw_deg == 33.0
        assert solution.position_error_m < 1e-12 and solution.rotation_error_deg < 1e-9
        assert np.allclose(solution.joints, joint, atol=1e-9)
        assert np.allclose(solution.pose.shaft_rotation, pose.shaft_rotation, atol=1e-9)


@EVERY
def test_without_a_near_configuration_the_pose_is_met_all_the_same(name):
    psm = arm(name)
    joints = random_joints(psm, 2000, seed=1)
    at = links(joints, psm.instrument)
    found, clamped = inverse_joints(at.tool_rotation, at.hinge, np.tile(psm.home, (2000, 1)), psm.instrument)
    reached = links(found, psm.instrument)
    assert not clamped.any()
    assert np.abs(reached.hinge - at.hinge).max() < 1e-12
    assert np.degrees(rotation_angle(reached.tool_rotation, at.tool_rotation)).max() < 1e-9


@EVERY
def test_the_shaft_passes_through_the_trocar_at_every_pose(name):
    psm = arm(name)
    joints = random_joints(psm, 500)
    joints[:, 3:] *= 1.2  # beyond the limits as well
    for joint in joints:
        solution = psm.inverse(psm.forward(joint, 0.0))
        pose, depth = solution.pose, solution.joints[2] - BEHIND_RCM
        y = pose.shaft_rotation[:, 1]
        along = np.cross(pose.rotation[:, 0], y)
        wrist = pose.position - psm.instrument.wrist_length * along
        assert np.linalg.norm(wrist - depth * pose.shaft_rotation[:, 2] - psm.rcm) < 1e-9
        assert abs(pose.rotation[:, 0] @ y) < 1e-12


def test_jacobian_is_the_derivative():
    psm, step = arm("mega"), 1e-6
    for joints in random_joints(psm, 10):
        jacobian = psm.jacobian(joints)
        for k in range(6):
            move = np.zeros(6)
            move[k] = step
            ahead, behind = psm.forward(joints + move, 0.0), psm.forward(joints - move, 0.0)
            turn = Rotation.from_matrix(ahead.rotation @ behind.rotation.T).as_rotvec() / (2 * step)
            assert np.allclose(jacobian[:3, k], (ahead.position - behind.position) / (2 * step), atol=1e-8)
            assert np.allclose(jacobian[3:, k], turn, atol=1e-8)
    straight = np.linalg.cond(psm.jacobian(psm.home))
    assert straight < 100  # a straight wrist is no singular place of this arm


@EVERY
def test_beyond_each_limit_the_joint_is_named_and_the_rest_is_told(name):
    psm = arm(name)
    low, high = psm.instrument.limits.T
    for k, joint in enumerate(JOINTS):
        if joint == "roll":
            continue  # more than a turn: every direction can be had
        wanted = psm.home.copy()
        wanted[k] = high[k] + (0.02 if joint == "insertion" else 0.15)
        solution = psm.inverse(psm.forward(wanted, 0.0), near=psm.home)
        assert joint in solution.limits
        assert solution.joints[k] == pytest.approx(high[k], abs=1e-12)
        assert (solution.joints >= low).all() and (solution.joints <= high).all()
        told = (solution.position_error_m, solution.rotation_error_deg)
        away = np.linalg.norm(solution.pose.position - psm.forward(wanted, 0.0).position)
        turned = np.degrees(rotation_angle(solution.pose.rotation, psm.forward(wanted, 0.0).rotation))
        assert told == pytest.approx((away, turned), abs=1e-12) and max(1e3 * told[0], told[1]) > 0.5
        if joint.startswith("wrist"):  # the hinge is where it was wanted, the wrist cannot bend so far
            assert told[0] < 1e-9 and told[1] < np.degrees(0.16)
        else:  # the tool is turned as wanted, the arm cannot go so far
            assert told[1] < 1e-6 and told[0] > 0.01


def test_roll_is_taken_near_to_the_given_one_within_its_range():
    psm = arm()
    pose = psm.forward(psm.home + np.array([0, 0, 0, np.radians(200), 0.2, 0.1]), 0.0)
    near = psm.home + np.array([0, 0, 0, np.radians(190), 0, 0])
    assert np.degrees(psm.inverse(pose, near=near).joints[3]) == pytest.approx(200)
    assert np.degrees(psm.inverse(pose).joints[3]) == pytest.approx(-160)
    pose = psm.forward(psm.home + np.array([0, 0, 0, np.radians(280), 0.2, 0.1]), 0.0)
    assert np.degrees(psm.inverse(pose, near=near).joints[3]) == pytest.approx(-80)


def test_a_path_turns_the_roll_steadily_and_tells_where_it_must_jump():
    psm = arm()

    def path(degrees):
        joints = np.tile(psm.home, (len(degrees), 1))
        joints[:, 3] = np.radians(degrees)
        poses = psm.poses(joints, np.zeros(len(degrees)))
        arrays = (np.stack([p.rotation for p in poses]), np.stack([p.position for p in poses]), np.zeros(len(poses)))
        return psm.inverse_path(*arrays)

    steady = path(np.linspace(-250, 250, 101))
    assert np.allclose(np.degrees(steady.joints[:, 3]), np.linspace(-250, 250, 101)) and not steady.jumps.any()
    jumping = path(np.linspace(0, 700, 141))
    assert jumping.jumps.sum() >= 1 and np.abs(np.degrees(jumping.joints[:, 3])).max() <= 260
    assert jumping.position_error_m.max() < 1e-12 and jumping.rotation_error_deg.max() < 1e-9


def test_jaws_keep_their_range():
    psm = arm()
    for wanted, reached in ((120.0, 80.0), (-45.0, -20.0), (80.0, 80.0), (30.0, 30.0)):
        solution = psm.inverse(psm.forward(psm.home, wanted))
        assert solution.jaw_deg == solution.pose.jaw_deg == reached
        assert ("jaw" in solution.limits) == (wanted != reached)


@EVERY
def test_with_the_wrist_at_the_trocar_the_shaft_stays_as_it_was(name):
    psm = arm(name)
    joints = np.array([0.3, -0.2, BEHIND_RCM, 1.0, 0.4, -0.3])
    solution = psm.inverse(psm.forward(joints, 0.0), near=joints)
    assert np.allclose(solution.joints, joints, atol=1e-8) and solution.position_error_m < 1e-9
    anywhere = psm.inverse(psm.forward(joints, 0.0))
    assert anywhere.position_error_m < 1e-9 and anywhere.rotation_error_deg < 1e-6
    behind = joints.copy()
    behind[2] = 0.001  # wrist outside the trocar
    assert np.allclose(psm.inverse(psm.forward(behind, 0.0), near=behind).joints, behind, atol=1e-9)


def test_a_hinge_on_the_trocar_gives_a_sound_answer():
    psm = arm()
    solution = psm.inverse(ToolPose(psm.rcm, T_SCENE_RCM[:3, :3] @ Rotation.from_rotvec([2.9, 0.3, 0]).as_matrix()))
    assert np.isfinite(solution.joints).all() and np.isfinite(solution.position_error_m)


def test_far_out_of_reach_the_answer_is_clamped_and_finite():
    psm, rng = arm(), np.random.default_rng(3)
    low, high = psm.instrument.limits.T
    for rotation in Rotation.random(50, random_state=3).as_matrix():
        solution = psm.inverse(ToolPose(psm.rcm + rng.normal(size=3), rotation))
        assert (solution.joints >= low).all() and (solution.joints <= high).all()
        assert solution.limits and solution.position_error_m > 0.01


def test_bad_input_is_refused():
    psm = arm()
    for pose in (
        ToolPose(np.array([np.nan, 0, 0])),
        ToolPose(np.zeros(3), np.full((3, 3), np.nan)),
        ToolPose(np.zeros(3), np.eye(3), np.inf),
    ):
        with pytest.raises(InputError):
            psm.inverse(pose)
    for joints in ([0, 0, 0.1, 0, 0], [0, 0, np.nan, 0, 0, 0], "home"):
        with pytest.raises(InputError, match="joints"):
            psm.forward(joints, 0.0)
    with pytest.raises(InputError, match="finite"):
        psm.forward(psm.home, np.nan)
    with pytest.raises(InputError, match="joints"):
        psm.inverse(psm.forward(psm.home, 0.0), near=[1, 2])
    with pytest.raises(InputError, match="rigid motion"):
        Psm(psm.instrument, np.diag([2.0, 2, 2, 1]))
    with pytest.raises(InputError, match="pose"):
        Psm(psm.instrument, np.full((4, 4), np.nan))
    with pytest.raises(InputError, match="large_needle_driver"):
        instrument_named("scalpel")
    with pytest.raises(InputError, match="wrist_pitch"):
        dataclasses.replace(psm.instrument, wrist_pitch=95.0)


def test_the_default_trocar_is_outside_the_organ_and_its_middle_in_reach():
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(2000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    for side, sign in (("right", 1), ("left", -1)):
        points = np.array([0.02, -0.01, 0.15]) + 0.04 * ball
        psm = Psm(INSTRUMENTS["large_needle_driver"], default_trocar(points, side=side))
        straight = psm.forward(psm.home, 0.0)
        assert np.linalg.norm(straight.position - points.mean(0)) < 1e-9
        assert sign * (psm.rcm - points.mean(0))[0] > 0.03 and psm.rcm[2] < points[:, 2].min() + 0.01
        assert np.linalg.norm(points - psm.rcm, axis=1).min() > 0.019
    large = default_trocar(np.array([0, 0, 0.3]) + 0.12 * ball)
    assert np.linalg.norm(np.array([0, 0, 0.3]) + 0.12 * ball - large[:3, 3], axis=1).min() > 0.019
    with pytest.raises(InputError, match="reaches"):
        default_trocar(np.array([0, 0, 0.9]) + 0.4 * ball)
    with pytest.raises(InputError, match="camera"):
        default_trocar(points, camera=points.mean(0))
