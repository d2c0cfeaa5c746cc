"""Times steps of the simulator: free motion, a poke, grasp and lift, with and without local detail.

    python Testing/benchmarks/simulation_step.py [organ.organphys] [--handles 20] [--quadrature 1000] [--steps 600]

Without a file it takes an ellipsoid of the size of a liver. Prints, and writes into RESULTS.md, median, 95th percentile
and maximum of the wall clock and of the process's own processor time, in ms, and how the steps went. Use
OMP_NUM_THREADS=1 for one core.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from results_file import machine_lines, write_part

from organphys.asset.asset_file import load_asset
from organphys.mechanics.tissue import PRESETS
from organphys.simulation.body import Body, build_body
from organphys.simulation.local_detail import LocalDetail
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.organ_body import organ_body
from organphys.simulation.pins import Pin
from organphys.simulation.rest_shape import rest_shape
from organphys.simulation.scene import Scene
from organphys.simulation.session import Simulation
from organphys.simulation.state import ToolPose
from organphys.simulation.tools import Tool, gripper, probe

RADII = np.array([0.11, 0.07, 0.045])
DT = 1 / 60


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("asset", nargs="?")
    parser.add_argument("--handles", type=int, default=20)
    parser.add_argument("--quadrature", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=600)
    options = parser.parse_args()
    start = time.perf_counter()
    body = pinned(body_of(options.asset, options.handles, options.quadrature))
    print(
        f"{body.name}: {1e6 * body.shape.volumes.sum():.0f} ml, {body.basis.size} columns, "
        f"{len(body.strain.weights)} quadrature points, {len(body.samples.points)} contact samples, "
        f"built twice in {time.perf_counter() - start:.1f} s, OMP_NUM_THREADS={os.environ.get('OMP_NUM_THREADS')}, "
        f"load {os.getloadavg()[0]:.1f}\nthe product of the gradients' {body.strain.rows.shape} matrix with Z takes "
        f"{product_ms(body):.2f} ms now: a measure of how busy the machine is"
    )
    print(f"{'':28s}{'wall ms':^24s}{'processor ms':^24s}")
    print(f"{'':28s}" + f"{'median':>8s}{'p95':>8s}{'max':>8s}" * 2 + "  newton   cg  deepest  volume  min det")
    poke, lift = poke_poses(body, options.steps), grasp_poses(body, options.steps)
    still = [()] * options.steps
    stiff = body.with_tissue(replace(body.tissue, nu=0.49))
    rows = [
        run("free", body, (), still),
        run("free, nu 0.49", stiff, (), still),
        run("poke", body, (probe(),), poke),
        run("grasp and lift", body, (gripper(),), lift),
        run("grasp and lift, nu 0.49", stiff, (gripper(),), lift),
        run("poke, local detail", body, (probe(),), poke, LocalDetail()),
        run("grasp and lift, local", body, (gripper(),), lift, LocalDetail()),
    ]
    write_part(Path(__file__).with_name("RESULTS.md"), markdown(body, rows))


def markdown(body: Body, rows: list[str]) -> str:
    """The part of RESULTS.md."""
    threads, arguments = os.environ.get("OMP_NUM_THREADS"), " ".join(sys.argv[1:])
    command = f"OMP_NUM_THREADS={threads} python Testing/benchmarks/simulation_step.py {arguments}".strip()
    head = "| run | wall ms: median | p95 | max | processor ms: median | p95 | max | steps/s (median, processor) |"
    head += " Newton | CG | deepest mm | volume drift | min det F |"
    return "\n".join(
        [
            "# Speed of the simulator",
            "",
            "Steps of 1/60 s. Wall clock and the process's own processor time: on a shared machine the second is "
            "nearer to what an idle one needs. Deepest: largest penetration of a tool of 2.5 mm radius (jaws 2 mm).",
            "",
            *machine_lines(command),
            f"- {body.name}: {body.basis.size} columns, {len(body.strain.weights)} quadrature points; one product of "
            f"the gradients' matrix with Z takes {product_ms(body):.2f} ms of processor time",
            "",
            head,
            "|---" * 13 + "|",
            *rows,
        ]
    )


def body_of(asset: str | None, handles: int, quadrature: int) -> Body:
    """The organ of a file, or an ellipsoid."""
    if asset is not None:
        return organ_body(load_asset(asset), handles=handles, quadrature=quadrature)
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(10_000, 4))
    points = RADII * ball[:, :3] / np.linalg.norm(ball, axis=1, keepdims=True)
    volumes = np.full(len(points), 4 / 3 * np.pi * RADII.prod() / len(points))
    vertices, faces = sphere_mesh(80, 160)
    shape = rest_shape(points, volumes, RADII * vertices, faces, handles=handles, quadrature=quadrature)
    return build_body(shape, tissue=PRESETS["liver"], name="ellipsoid")


def product_ms(body: Body) -> float:
    """Median processor time of one evaluation of all deformation gradients, ms."""
    z, times = np.ones((body.basis.size, 3)), []
    for _ in range(200):
        start = time.process_time()
        body.strain.rates(z)
        times.append(time.process_time() - start)
    return 1e3 * float(np.median(times))


def sphere_mesh(rings: int, around: int) -> tuple[np.ndarray, np.ndarray]:
    """Unit sphere, faces counter-clockwise from outside; the poles are small triangles of repeated vertices."""
    polar, angle = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.arange(around) * 2 * np.pi / around, indexing="ij")
    vertices = np.stack([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], -1)
    row, column = (k.ravel() for k in np.mgrid[:rings, :around])
    a, b = row * around + column, row * around + (column + 1) % around
    faces = np.concatenate([np.stack([a, a + around, b + around], 1), np.stack([a, b + around, b], 1)])
    return vertices.reshape(-1, 3), faces


def pinned(body: Body) -> Body:
    """Held at both ends of its longest axis."""
    points = body.samples.points
    middle = points.mean(0)
    axis = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    along = (points - middle) @ axis
    size = 0.15 * np.ptp(along)
    return body.with_pins(*(Pin(tuple(points[k]), size) for k in (along.argmin(), along.argmax())))


def facing(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Surface point (3,) m nearest above the middle against gravity, and a tool's rotation (3, 3) to meet it there."""
    points, middle = body.samples.points, body.samples.points.mean(0)
    beside = np.hypot(*(points - middle)[:, :2].T)
    near = np.flatnonzero(beside < 1.1 * beside.min() + 0.003)
    return points[near[points[near, 2].argmax()]], np.diag([1.0, -1.0, -1.0])


def poke_poses(body: Body, steps: int) -> list[tuple[ToolPose, ...]]:
    """In by 12 mm, along by 20 mm, out again, over the whole run."""
    top, turn = facing(body)
    depth = np.interp(np.linspace(0, 1, steps), [0, 0.3, 0.7, 1], [-0.006, 0.012, 0.012, -0.02])
    shift = np.interp(np.linspace(0, 1, steps), [0, 0.35, 0.65, 1], [0, 0, 0.02, 0.02])
    return [(ToolPose(top + np.array([x, 0, -z]), turn),) for x, z in zip(shift, depth, strict=True)]


def grasp_poses(body: Body, steps: int) -> list[tuple[ToolPose, ...]]:
    """Down with open jaws, close, lift by 20 mm, hold, open."""
    top, turn = facing(body)
    part = np.linspace(0, 1, steps)
    height = np.interp(part, [0, 0.2, 0.3, 0.6, 1], [0.02, 0.0, 0.0, 0.02, 0.02])
    jaw = np.interp(part, [0, 0.2, 0.3, 0.85, 0.9], [60, 60, 5, 5, 60])
    return [(ToolPose(top + np.array([0, 0, z]), turn, j),) for z, j in zip(height, jaw, strict=True)]


def run(
    name: str,
    body: Body,
    tools: tuple[Tool, ...],
    poses: list[tuple[ToolPose, ...]],
    detail: LocalDetail | None = None,
) -> str:
    """One run: prints its line and returns its row of the table."""
    gravity = gravity_along([0, 0, -1]) if not tools else np.zeros(3)  # an organ is registered as gravity holds it
    scene = Scene((body,), tools, SimulationOptions(gravity=gravity))
    simulation = Simulation(scene, scene.initial_state(*poses[0]), detail=detail)
    simulation.step(poses[0])  # what is made once
    wall, own, reports = [], [], []
    for pose in poses:
        clock, processor = time.perf_counter(), time.process_time()
        reports.append(simulation.step(pose, dt=DT).bodies[0])
        wall.append(1e3 * (time.perf_counter() - clock))
        own.append(1e3 * (time.process_time() - processor))
    times = "".join(f"{np.median(t):8.1f}{np.percentile(t, 95):8.1f}{np.max(t):8.1f}" for t in (wall, own))
    how = (
        np.mean([r.solve.iterations for r in reports]),
        np.mean([r.cg_steps for r in reports]),
        1e3 * max(r.deepest_m for r in reports),
        100 * max(abs(r.volume_change) for r in reports),
        min(r.min_det for r in reports),
    )
    print(f"{name:28s}{times}  {how[0]:6.2f}{how[1]:5.1f}{how[2]:6.2f} mm{how[3]:6.2f} %{how[4]:8.2f}", flush=True)
    cells = [f"{x:.1f}" for t in (wall, own) for x in (np.median(t), np.percentile(t, 95), np.max(t))]
    cells += [f"{1e3 / np.median(own):.0f}", f"{how[0]:.2f}", f"{how[1]:.1f}", f"{how[2]:.2f}", f"{how[3]:.2f} %"]
    return "| " + " | ".join([name, *cells, f"{how[4]:.2f}"]) + " |"


if __name__ == "__main__":
    main()
