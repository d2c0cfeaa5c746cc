"""Inverse kinematics of the PSM: time and error of the closed form and, where it is installed, of newton.ik.

    python Testing/benchmarks/psm.py [--poses 2000] [--newton-poses 500]

Poses are forward kinematics of random joints inside the limits; errors are of the pose reached, in double precision.
Writes its part of RESULTS.md.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from measured import how
from results_file import write_part

from organphys.simulation.instruments import BEHIND_RCM
from organphys.simulation.psm import INSTRUMENTS, Psm, PsmSolution
from organphys.simulation.psm_newton import newton_inverse
from organphys.simulation.state import ToolPose

RESULTS = Path(__file__).parent / "RESULTS.md"
HEAD = (
    "| instrument | solver | poses | processor ms, median | p95 | wall ms, median | largest error mm "
    "| largest error deg | clamped |"
)
RULE = "| --- " * 9 + "|"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=2000)
    parser.add_argument("--newton-poses", type=int, default=500)
    options = parser.parse_args()
    has_newton = importlib.util.find_spec("newton") is not None
    rows, notes = [], []
    for name, instrument in INSTRUMENTS.items():
        psm = Psm(instrument, np.eye(4))
        rows += closed_form(name, psm, options.poses)
        if has_newton:
            more, note = newton(name, psm, options.newton_poses)
            rows += more
            notes += [note] if name == next(iter(INSTRUMENTS)) else []
    command = f"python Testing/benchmarks/psm.py --poses {options.poses} --newton-poses {options.newton_poses}"
    versions = f", newton {version('newton')}, warp-lang {version('warp-lang')}" if has_newton else ""
    text = "\n".join([HEAD, RULE, *rows, "", *notes])
    intro = (
        "Poses are forward kinematics of random joints over the whole ranges, so each can be reached; the error is of "
        "the pose that the joints found give, in double precision. One pose per call, each from the middle of the "
        "ranges, but for 'as a path' (one call for all) and newton's 'all at once'."
    )
    write_part(RESULTS, f"# Inverse kinematics of the PSM\n\n{intro}\n\n{how(command)}{versions}\n\n{text}\n")
    print(text)


def random_poses(psm: Psm, count: int, seed: int = 0) -> tuple[np.ndarray, tuple[ToolPose, ...]]:
    """Joints (N, 6) over the whole ranges and their poses."""
    low, high = psm.instrument.limits.T
    joints = np.random.default_rng(seed).uniform(low, high, (count, 6))
    return joints, psm.poses(joints, np.full(count, 20.0))


def closed_form(name: str, psm: Psm, count: int) -> list[str]:
    joints, poses = random_poses(psm, count)
    inside = joints[:, 2] > 2 * BEHIND_RCM
    out = []
    for title, chosen in (("closed form", inside), ("closed form, wrist within 15.6 mm of the RCM", ~inside)):
        some = [pose for pose, one in zip(poses, chosen, strict=True) if one]
        out.append(row(name, title, *timed(psm.inverse, some)))
    low, high = psm.instrument.limits.T
    beyond = np.random.default_rng(1).uniform(low, high, (count // 10, 6))
    beyond[:, 4], beyond[:, 2] = high[4] + 0.3, np.maximum(beyond[:, 2], 0.06)
    out.append(row(name, "closed form, beyond the wrist's limit", *timed(psm.inverse, psm.poses(beyond, beyond[:, 0]))))
    arrays = np.stack([p.rotation for p in poses]), np.stack([p.position for p in poses]), np.zeros(count)
    wall, own = time.perf_counter(), time.process_time()
    path = psm.inverse_path(*arrays)
    each = [1e3 * (now - then) / count for now, then in ((time.process_time(), own), (time.perf_counter(), wall))]
    errors = (1e3 * path.position_error_m.max(), path.rotation_error_deg.max())
    out.append(
        f"| {name} | closed form, as a path | {count} | {each[0]:.4f} | | {each[1]:.4f} | {errors[0]:.1e} | "
        f"{errors[1]:.1e} | {int(path.clamped.any(1).sum())} |"
    )
    return out


def newton(name: str, psm: Psm, count: int) -> tuple[list[str], str]:
    joints, poses = random_poses(psm, count)
    start = time.perf_counter()
    newton_inverse(psm, poses[:1])
    newton_inverse(psm, [psm.forward(psm.home + np.array([0, 0, 0.2, 0, 0, 0]), 0.0)])  # the second round's kernels
    first = time.perf_counter() - start
    moved = joints + 0.01 * np.random.default_rng(2).normal(size=joints.shape) * [1, 1, 0.1, 1, 1, 1]
    starts = iter(moved)
    warm = timed(lambda pose: newton_inverse(psm, [pose], near=next(starts))[0], poses[:100])
    wall, own = time.perf_counter(), time.process_time()
    solutions = newton_inverse(psm, poses)
    each = [((time.perf_counter() - wall) / count, (time.process_time() - own) / count)] * count
    rows = [row(name, "newton, from 0.01 rad beside", *warm), row(name, "newton, all at once", each, list(solutions))]
    note = f"Newton's first calls in this process took {first:.1f} s (kernels loaded, or compiled if not on disk yet)."
    return rows, note


def timed(
    solve: Callable[[ToolPose], PsmSolution], poses: list[ToolPose] | tuple[ToolPose, ...]
) -> tuple[list[tuple[float, float]], list[PsmSolution]]:
    """Wall and processor seconds of every call, and the solutions."""
    times, solutions = [], []
    for pose in poses:
        wall, own = time.perf_counter(), time.process_time()
        solutions.append(solve(pose))
        times.append((time.perf_counter() - wall, time.process_time() - own))
    return times, solutions


def row(name: str, solver: str, times: list[tuple[float, float]], solutions: list[PsmSolution]) -> str:
    away = 1e3 * max(s.position_error_m for s in solutions)
    turned = max(s.rotation_error_deg for s in solutions)
    clamped = sum(bool(s.limits) for s in solutions)
    wall, own = 1e3 * np.array(times).T
    own_ms, wall_ms = f"{np.median(own):.3f} | {np.percentile(own, 95):.3f}", f"{np.median(wall):.3f}"
    return f"| {name} | {solver} | {len(times)} | {own_ms} | {wall_ms} | {away:.1e} | {turned:.1e} | {clamped} |"


if __name__ == "__main__":
    main()
