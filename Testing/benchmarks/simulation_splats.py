"""Times means and covariances of Gaussians that follow an organ, on a grid in numpy and by warp on the CPU.

    OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_splats.py [--counts 100000 650000] [--frames 30] [--warp]

Gaussians lie on the whole surface of an ellipsoid of the size of a liver, strained by up to 30 %; of those marked
"fading" half lie in the band where they follow less and less. Errors are those of the grid against the exact motion of
2000 of them. Writes its part of RESULTS.md.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from results_file import machine_lines, write_part
from simulation_step import body_of

from organphys.points.gaussians import Gaussians
from organphys.simulation.body import Body
from organphys.simulation.quick_splat import on_device, quick_splat
from organphys.simulation.splat_binding import bind_splat
from organphys.simulation.splat_threads import THREADS

UNIT = 0.1  # metres per scene unit


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--counts", type=int, nargs="+", default=[100_000, 650_000])
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--warp", action="store_true")
    options = parser.parse_args()
    body, rows = body_of(None, 20, 1000), []
    z = np.random.default_rng(1).normal(size=(body.basis.size, 3))
    z *= 0.3 / np.abs(body.strain.rates(z)).max()
    for count in options.counts:
        for name, distance in (("", 0.003), (", half of them fading", 0.0)):
            quick = quick_splat(body, gaussians(body, count), UNIT, distance=distance)
            for device in ("numpy", "cpu")[: 1 + options.warp]:
                moving = on_device(quick, device)
                moving.frame(body, z)
                title = f"{count}{name}, by {device}"
                rows.append(row(title, lambda moving=moving: moving.frame(body, z), options.frames))
    command = " ".join(["OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_splats.py", *sys.argv[1:]])
    lines = ["# Speed of the splats", "", *machine_lines(command), f"- {THREADS} threads", *errors(body, z), ""]
    lines += ["| Gaussians | wall ms: median | best | processor ms (all threads): median | best |", "|---" * 5 + "|"]
    write_part(Path(__file__).with_name("RESULTS.md"), "\n".join([*lines, *rows]))


def errors(body: Body, z: np.ndarray) -> list[str]:
    """Largest errors of the grid, against the exact motion."""
    splat = gaussians(body, 2000)
    quick, exact = quick_splat(body, splat, UNIT), bind_splat(body, splat, UNIT)
    order = np.argsort(quick.index)
    (u, shape), (true_u, true_shape) = quick.frame(body, z), exact.frame(body, z)
    off_u = np.linalg.norm(u[order] - true_u, axis=1)
    off_shape = np.linalg.norm(shape[order] - true_shape, axis=(1, 2)) / np.linalg.norm(true_shape, axis=(1, 2))
    moved = float(np.linalg.norm(true_u, axis=1).max())
    return [
        f"- error of the grid: displacement at most {1e3 * UNIT * off_u.max():.3f} mm of {1e3 * UNIT * moved:.1f} mm, "
        f"covariance {100 * off_shape.max():.2f} % at most, {100 * np.median(off_shape):.2f} % in the median"
    ]


def gaussians(body: Body, count: int) -> Gaussians:
    """On the surface and up to about 2 mm beside it."""
    rng = np.random.default_rng(0)
    points = body.samples.points[rng.integers(len(body.samples.points), size=count)]
    points = points + 7e-4 * rng.normal(size=(count, 3))
    return Gaussians(
        means=(points / UNIT).astype(np.float32),
        log_scales=np.log(rng.uniform(0.001, 0.02, (count, 3))).astype(np.float32),
        quaternions=rng.normal(size=(count, 4)).astype(np.float32),
        opacity_logits=np.zeros(count, dtype=np.float32),
        sh_dc=np.zeros((count, 3), dtype=np.float32),
        sh_rest=np.zeros((count, 3, 0), dtype=np.float32),
        valid=np.ones(count, dtype=bool),
        extra={},
    )


def row(name, work, frames: int) -> str:
    """Times ``work`` and returns its row."""
    wall, own = [], []
    for _ in range(frames):
        clock, processor = time.perf_counter(), time.process_time()
        work()
        wall.append(1e3 * (time.perf_counter() - clock))
        own.append(1e3 * (time.process_time() - processor))
    numbers = (np.median(wall), min(wall), np.median(own), min(own))
    print(name, *(f"{x:.1f}" for x in numbers), flush=True)
    return "| " + " | ".join([name, *(f"{x:.1f}" for x in numbers)]) + " |"


if __name__ == "__main__":
    main()
