"""The PSM's inverse kinematics by NVIDIA Newton's solver (newton.ik, a Levenberg-Marquardt method), for comparison.

Newton works in single precision and keeps joint limits only as a soft cost. So lengths are in decimetres, the two
offsets along the shaft are one, and the poses are solved in rounds: from the given configuration; those that end off
the pose or beyond a limit again from several starts with the limits in the cost, and from where that ends without
them, so that the limits' cost leaves no error. It is slowest with the wrist near the trocar, where the arm is
singular. Errors are told by the double-precision forward kinematics.

The closed form (``Psm.inverse``) is exact and faster: it is the default.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..ground.checks import Array, InputError
from .instruments import BEHIND_RCM, DH_ALPHA, DH_THETA, JOINTS, PRISMATIC, R_6_TOOL, Instrument
from .psm import Psm, PsmSolution, as_joints
from .psm_inverse import pose_errors
from .psm_kinematics import links
from .state import ToolPose
from .tools import checked_pose

PER_METRE = 10.0  # the solver's lengths are decimetres: of the size of the angles
FIRST, STEPS = 6, 8  # the first round: up to so many runs of so many steps
RETRIES = ((8, 60, 100), (64, 100, 300))  # starts, steps with the limits in the cost, steps without; for what is left
LIMIT_WEIGHT = 0.3
NEAR_ENOUGH_M, NEAR_ENOUGH_DEG = 5e-7, 5e-4  # what single precision reaches with a margin
BEYOND = 1e-5  # rad, m: a joint so far beyond its limit is clamped and named


class Arm(NamedTuple):
    """Newton's model of an instrument's arm, its last link, and the device that solves."""

    newton: Any
    warp: Any
    model: Any
    link: int
    device: str


class Solver(NamedTuple):
    """newton.ik's solver and warp's arrays: hinges dm, turns (x, y, z, w), joints at the start and at the end."""

    ik: Any
    places: Any
    turns: Any
    first: Any
    last: Any


def newton_inverse(
    psm: Psm, poses: Sequence[ToolPose], *, near: ArrayLike | None = None, device: str = "cpu"
) -> tuple[PsmSolution, ...]:
    """Solutions for poses, all at once; each from joints ``near`` (6,), the middle of the ranges if not given.

    InputError if newton is not installed or has no such device. The first call compiles kernels (about half a minute
    on a CPU; they are kept on disk).
    """
    start = psm.home if near is None else as_joints(near)
    checked = [checked_pose(pose, "tool pose") for pose in poses]
    if not checked:
        return ()
    arm = _arm(psm.instrument, device)
    turn = psm.T_scene_rcm[:3, :3]
    rotation = turn.T @ np.stack([pose.rotation for pose in checked])
    hinge = (np.stack([pose.position for pose in checked]) - psm.rcm) @ turn
    joints, clamped = _solved(arm, psm.instrument, rotation, hinge, np.tile(start, (len(checked), 1)))
    return psm.solutions(joints, clamped, rotation, hinge, np.array([pose.jaw_deg for pose in checked]))


def _solved(
    arm: Arm, instrument: Instrument, rotation: Array, hinge: Array, start: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """Joints (N, 6) inside the limits and which were clamped."""
    joints = start
    for _ in range(FIRST):
        joints = _round(arm, rotation, hinge, joints, STEPS)
        if (_badness(instrument, joints, rotation, hinge) <= 1).all():
            break
    for seeds, steps, more in RETRIES:
        again = np.flatnonzero(_badness(instrument, joints, rotation, hinge) > 1)
        if not len(again):
            break
        target = rotation[again], hinge[again]
        limited = _round(arm, *target, start[again], steps, seeds)
        found = np.stack([joints[again], limited, _round(arm, *target, limited, more)])
        best = np.argmin([_badness(instrument, one, *target) for one in found], axis=0)
        joints[again] = found[best, np.arange(len(again))]
    low, high = instrument.limits.T
    clamped = (joints < low - BEYOND) | (joints > high + BEYOND)
    joints = np.clip(joints, low, high)
    return joints, clamped & (_badness(instrument, joints, rotation, hinge) > 1)[:, None]


def _badness(instrument: Instrument, joints: Array, rotation: Array, hinge: Array) -> Array:
    """(N,): up to 1 where the pose is met inside the limits; a joint beyond its limit counts most."""
    low, high = instrument.limits.T
    away, angle = pose_errors(links(joints, instrument), rotation, hinge)
    beyond = np.maximum(np.maximum(low - joints, joints - high), 0.0).max(1)
    missed = np.maximum(away / NEAR_ENOUGH_M, angle / NEAR_ENOUGH_DEG)
    out: Array = np.where(beyond > BEYOND, 1e9 * (1 + beyond), missed)
    return out


def _round(arm: Arm, rotation: Array, hinge: Array, start: Array, steps: int, seeds: int = 0) -> Array:
    """One run of the solver over all poses; with ``seeds`` from so many starts and with the limits in the cost."""
    turns = Rotation.from_matrix(rotation @ R_6_TOOL.T).as_quat()
    units = np.where(PRISMATIC, PER_METRE, 1.0)
    with contextlib.redirect_stdout(io.StringIO()):  # warp tells of every kernel that it compiles
        solver = _solver(arm, len(start), seeds)
        solver.places.assign((PER_METRE * hinge).astype(np.float32))
        solver.turns.assign(turns.astype(np.float32))
        solver.first.assign((start * units).astype(np.float32))
        solver.ik.reset()
        solver.ik.step(solver.first, solver.last, iterations=steps)
    out: Array = solver.last.numpy().astype(np.float64) / units
    return out


@lru_cache(maxsize=6)
def _solver(arm: Arm, count: int, seeds: int) -> Solver:
    """Newton's solver for so many poses and its arrays."""
    wp, ik = arm.warp, arm.newton.ik
    places = wp.zeros(count, dtype=wp.vec3, device=arm.device)
    turns = wp.zeros(count, dtype=wp.vec4, device=arm.device)
    objectives = [
        ik.IKObjectivePosition(arm.link, wp.vec3(0.0, 0.0, 0.0), places),
        ik.IKObjectiveRotation(arm.link, wp.quat_identity(), turns),
    ]
    several = {}
    if seeds:
        ends = arm.model.joint_limit_lower, arm.model.joint_limit_upper
        objectives.append(ik.IKObjectiveJointLimit(*ends, weight=LIMIT_WEIGHT))
        several = {"sampler": ik.IKSampler.ROBERTS, "n_seeds": seeds}
    solver = ik.IKSolver(arm.model, count, objectives, jacobian_mode=ik.IKJacobianType.ANALYTIC, **several)
    first = wp.zeros((count, len(JOINTS)), dtype=wp.float32, device=arm.device)
    return Solver(solver, places, turns, first, wp.zeros_like(first))


@lru_cache(maxsize=4)
def _arm(instrument: Instrument, device: str) -> Arm:
    """The kinematic chain of the table as Newton's joints."""
    newton, wp = _loaded(device)
    builder, joints, parent = newton.ModelBuilder(), [], -1
    low, high = instrument.limits.T
    for k in range(6):
        about_x = Rotation.from_rotvec([DH_ALPHA[k], 0, 0])
        along = -BEHIND_RCM if PRISMATIC[k] else 0.0  # both offsets along the shaft in one, exact in single precision
        place = about_x.apply([instrument.wrist_length if k == 5 else 0.0, 0, along])  # a is along x
        turn = (about_x * Rotation.from_rotvec([0, 0, DH_THETA[k]])).as_quat()
        child = builder.add_link(mass=1.0, inertia=wp.mat33(np.eye(3)))
        add = builder.add_joint_prismatic if PRISMATIC[k] else builder.add_joint_revolute
        unit = PER_METRE if PRISMATIC[k] else 1.0
        pose = wp.transform(wp.vec3(*(PER_METRE * place).tolist()), wp.quat(*turn.tolist()))
        limits = {"limit_lower": float(unit * low[k]), "limit_upper": float(unit * high[k])}
        joints.append(add(parent, child, parent_xform=pose, axis=newton.Axis.Z, **limits))
        parent = child
    builder.add_articulation(joints)
    with contextlib.redirect_stdout(io.StringIO()):
        model = builder.finalize(device=device)
    return Arm(newton, wp, model, parent, device)


def _loaded(device: str) -> tuple[Any, Any]:
    """The modules newton and warp, or InputError."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            import newton
            import newton.ik
            import warp

            warp.init()
    except ImportError as error:
        raise InputError(
            f"Newton's inverse kinematics: {error}; install it with pip install 'organphys[newton]', or take the "
            "closed form, which needs nothing"
        ) from error
    names = [one.alias for one in warp.get_devices()]
    if device not in names:
        raise InputError(f"device: warp has {', '.join(names)}, not {device!r}")
    return newton, warp
