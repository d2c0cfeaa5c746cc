"""Speed of the splat update on an NVIDIA GPU, and how far it is from the same on the CPU.

    OMP_NUM_THREADS=1 python Testing/benchmarks/gpu_speed.py [--counts 100000 650000 3000000] [--frames 200]

Needs warp-lang (extra "gpu") and a CUDA device. Without one it says so, and so does RESULTS.md, unless it holds figures
of an earlier run, with how far the same kernels are from numpy when warp runs them on the CPU. --device cpu times these
and writes nothing.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from results_file import machine_lines, write_part
from simulation_splats import UNIT, gaussians
from simulation_step import body_of

from organphys.ground.checks import InputError
from organphys.simulation.body import Body
from organphys.simulation.quick_splat import QuickSplat, quick_splat
from organphys.simulation.splat_warp import WarpMover, check_device

TOLERANCE = 2e-5  # of the largest displacement or covariance: single precision in another order
RESULTS = Path(__file__).with_name("RESULTS.md")
TITLE = "# Speed of the splats on a GPU"
CHECKED = 100_000  # Gaussians moved where there is no GPU
AIM = 120.0  # updates a second of 650,000 Gaussians on a data-centre GPU


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--counts", type=int, nargs="+", default=[100_000, 650_000, 3_000_000])
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--device", choices=("cuda", "cpu"), default="cuda")
    options = parser.parse_args()
    body = body_of(None, 20, 1000)
    try:
        check_device(options.device)
    except InputError as error:
        print(f"skipped: {error}")
        if TITLE not in RESULTS.read_text(encoding="utf-8"):
            write_part(RESULTS, skipped(str(error), body))
        return
    rows = [row(body, quick_splat(body, gaussians(body, count), UNIT), options) for count in options.counts]
    if options.device == "cuda":
        command = " ".join(["OMP_NUM_THREADS=1 python Testing/benchmarks/gpu_speed.py", *sys.argv[1:]])
        write_part(RESULTS, report(command, rows))


def row(body: Body, quick: QuickSplat, options: argparse.Namespace) -> str:
    """One size: updates a second that stay on the device, with the copy to the host, and by numpy; and the error."""
    import warp

    mover = WarpMover(quick.bound, quick.grid, quick.exact.covariance, options.device, nodes_too=True)
    by_warp = replace(quick, mover=mover)
    poses = coordinates(body, options.frames)
    error = max(largest_error(quick, by_warp, body, z) for z in poses[:3])
    if not error < TOLERANCE:
        raise SystemExit(f"{options.device} is off by {error:.1e} of the largest value, more than {TOLERANCE:.0e}")

    def stay(z: np.ndarray) -> None:
        mover.on_device(z, None, z[:0])
        warp.synchronize_device(options.device)

    rates = [
        per_second(stay, poses),
        per_second(lambda z: by_warp.frame(body, z), poses),
        per_second(lambda z: quick.frame(body, z), poses[:20]),
    ]
    cells = [f"{len(quick.index):,}", f"{len(quick.grid.phi):,}", *(f"{rate:.0f}" for rate in rates), f"{error:.1e}"]
    print(" | ".join(cells), flush=True)
    return "| " + " | ".join(cells) + " |"


def coordinates(body: Body, frames: int) -> list[np.ndarray]:
    """Z (n, 3) of a motion that swings between no strain and 30 %."""
    shape = np.random.default_rng(1).normal(size=(body.basis.size, 3))
    shape *= 0.3 / np.abs(body.strain.rates(shape)).max()
    return [shape * np.sin(0.1 * k + 0.5) for k in range(frames)]


def largest_error(quick: QuickSplat, by_warp: QuickSplat, body: Body, z: np.ndarray) -> float:
    """Of displacements and covariances, relative to the largest of them."""
    pairs = zip(quick.frame(body, z), by_warp.frame(body, z), strict=True)
    return max(float(np.abs(mine - other).max() / np.abs(mine).max()) for mine, other in pairs)


def per_second(update: Callable[[np.ndarray], object], poses: list[np.ndarray]) -> float:
    """Updates a second by the clock, in the median."""
    update(poses[0])
    times = []
    for z in poses:
        start = time.perf_counter()
        update(z)
        times.append(time.perf_counter() - start)
    return 1 / float(np.median(times))


def skipped(reason: str, body: Body) -> str:
    """The part of RESULTS.md of a machine without a GPU: why, and the error of the same kernels on the CPU."""
    quick = quick_splat(body, gaussians(body, CHECKED), UNIT)
    mover = WarpMover(quick.bound, quick.grid, quick.exact.covariance, "cpu", nodes_too=True)
    error = max(largest_error(quick, replace(quick, mover=mover), body, z) for z in coordinates(body, 20))
    text = (
        f"Skipped: {reason}. Aim: {AIM:.0f} updates a second of 650,000 Gaussians. The same kernels, run by warp on "
        f"the CPU, differ from numpy by at most {error:.1e} of the largest displacement or covariance ({CHECKED:,} "
        f"Gaussians, 20 poses; tolerance {TOLERANCE:.0e})."
    )
    return "\n".join([TITLE, "", *machine_lines("python Testing/benchmarks/gpu_speed.py"), "", text])


def report(command: str, rows: list[str]) -> str:
    """The part of RESULTS.md."""
    import warp

    return "\n".join(
        [
            TITLE,
            "",
            f"Updates a second (median, by the clock) of means and covariances; aim: {AIM:.0f} of 650,000 Gaussians. "
            "Error: largest difference to numpy on the CPU, relative to the largest value.",
            "",
            *machine_lines(command),
            f"- GPU: {warp.get_device('cuda').name}, warp {warp.config.version}",
            "",
            "| Gaussians | nodes | on the device | with the copy to the host | numpy on the CPU | error |",
            "|---" * 6 + "|",
            *rows,
        ]
    )


if __name__ == "__main__":
    main()
