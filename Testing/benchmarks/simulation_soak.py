"""Random tool trajectories for a minute each: nothing may become NaN, turn inside out, or take long.

    python Testing/benchmarks/simulation_soak.py [organ.organphys] [--seeds 10] [--seconds 60] [--detail]

A gripper wanders over, into and out of the organ with random speeds up to 200 mm/s and random jaws; in every other
seed a tenth of gravity draws the organ towards it. Prints one line per seed, writes them into RESULTS.md and ends with
status 1 if any run failed (NaN, det F <= 0, a penetration of more than 0.3 mm, or a step of more than 100 ms of
processor time). Effort: work of a step in Hessian products (see SimulationOptions), which does not depend on how busy
the machine is.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np
from results_file import machine_lines, write_part
from simulation_step import DT, body_of, facing, pinned

from organphys.ground.frames import rotation_about
from organphys.simulation.body import Body
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import ToolPose
from organphys.simulation.tools import gripper

FASTEST = 0.2  # m/s
SLOWEST = 100.0  # ms
DEEPEST = 3e-4  # m
HEAD = "| seed | ok | min det F | deepest mm | largest force N | steps holding |"
HEAD += " processor ms: median | p95 | max | largest effort | stops |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("asset", nargs="?")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--detail", action="store_true")
    options = parser.parse_args()
    body = pinned(body_of(options.asset, 20, 1000))
    detail = LocalDetail() if options.detail else None
    title = "# Soak of the simulator" + (", with local detail" if detail else "")
    command = f"OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS')} python Testing/benchmarks/simulation_soak.py"
    good, rows = [], []
    for seed in range(options.seeds):
        fine, row = soak(body, seed, round(options.seconds / DT), detail)
        good.append(fine)
        rows.append(row)
        lines = [title, "", *machine_lines(" ".join([command, *sys.argv[1:]])), "", HEAD, "|---" * 11 + "|"]
        write_part(Path(__file__).with_name("RESULTS.md"), "\n".join([*lines, *rows]))
    sys.exit(0 if all(good) else 1)


def trajectory(body: Body, seed: int, steps: int) -> list[ToolPose]:
    """Random targets near the organ, approached at random speeds, with random tilts and jaw openings."""
    rng = np.random.default_rng(seed)
    top, turn = facing(body)
    position, jaw, tilt, poses = top + np.array([0, 0, 0.03]), 40.0, np.zeros(3), []
    while len(poses) < steps:
        target = top + rng.normal(size=3) * [0.02, 0.02, 0.012] + [0, 0, 0.004]
        wanted, lean, speed = rng.uniform(0, 70), 0.3 * rng.normal(size=3), rng.uniform(0.01, FASTEST)
        count = max(int(np.linalg.norm(target - position) / (speed * DT)), 8)
        for part in np.linspace(0, 1, count + 1)[1:]:
            way = tilt + part * (lean - tilt)
            spin = rotation_about(way, float(np.linalg.norm(way))) if way.any() else np.eye(3)
            poses.append(ToolPose(position + part * (target - position), spin @ turn, jaw + part * (wanted - jaw)))
        position, jaw, tilt = target, wanted, lean
    return poses[:steps]


def soak(body: Body, seed: int, steps: int, detail: LocalDetail | None) -> tuple[bool, str]:
    """One run: whether all went well, and its row of the table; prints a line."""
    gravity = 0.1 * gravity_along([0, 0, 1]) if seed % 2 else np.zeros(3)
    poses = trajectory(body, seed, steps)
    scene = Scene((body,), (gripper(),), SimulationOptions(gravity=gravity))
    simulation = Simulation(scene, scene.initial_state(poses[0]), detail=detail)
    times, lowest, deepest, force, stops, held, effort = [], 1.0, 0.0, 0.0, {}, 0, 0
    for pose in poses:
        start = time.process_time()
        report = simulation.step((pose,), dt=DT)
        times.append(1e3 * (time.process_time() - start))
        one, effort = report.bodies[0], max(effort, report.effort)
        lowest, deepest = min(lowest, one.min_det), max(deepest, one.deepest_m)
        force = max(force, float(np.linalg.norm(report.forces[0].force)))
        stops[one.solve.stop.name] = stops.get(one.solve.stop.name, 0) + 1
        held += bool(len(simulation.state.bodies[0].grips[0].sample))
    fine = bool(np.isfinite(simulation.state.bodies[0].z).all()) and lowest > 0
    fine = fine and max(times) < SLOWEST and deepest < DEEPEST
    print(
        f"seed {seed}: {'ok    ' if fine else 'FAILED'} min det F {lowest:.3f}, deepest {1e3 * deepest:.2f} mm, force "
        f"up to {force:.1f} N, holding in {held} of {steps} steps, processor ms median {np.median(times):.1f}, p95 "
        f"{np.percentile(times, 95):.1f}, max {max(times):.0f}, largest effort {effort}, {stops}",
        flush=True,
    )
    middle, late = np.median(times), np.percentile(times, 95)
    cells = [
        seed,
        "ok" if fine else "no",
        f"{lowest:.3f}",
        f"{1e3 * deepest:.2f}",
        f"{force:.1f}",
        held,
        f"{middle:.1f}",
    ]
    cells += [f"{late:.1f}", f"{max(times):.0f}", effort, ", ".join(f"{name} {n}" for name, n in stops.items())]
    return fine, "| " + " | ".join(str(cell) for cell in cells) + " |"


if __name__ == "__main__":
    main()
