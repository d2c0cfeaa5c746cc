"""The simulator against full finite elements (quadratic tetrahedra, scikit-fem) on the same body, for more handles.

    OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_truth.py [--handles 6 10 20 40 60]

Two loads on a liver-like ellipsoid (Neo-Hookean, E 5.5 kPa, nu 0.45): its own weight, and a patch pulled sideways.
Errors are rms over the volume in parts of the rms displacement. Writes its part of RESULTS.md and the curves beside it.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from results_file import machine_lines, write_part

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "core"))
from fem_reference import Loads, Quadratic, refined, solve  # noqa: E402
from truth_examples import LOADS, TISSUE, body_of, load_case, mesh_of, relative_error, simulated  # noqa: E402


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--handles", type=int, nargs="+", default=[6, 10, 20, 40, 60])
    parser.add_argument("--cells", type=int, default=4)
    options = parser.parse_args()
    rows, curves, references = [], {}, []
    mesh = mesh_of(options.cells)
    for name in LOADS:
        loads = load_case(mesh, name)
        coarse, fine, change, seconds = reference(mesh, loads)
        largest = 1e3 * float(np.linalg.norm(fine[1], axis=1).max())
        references.append((name, len(coarse[1]), len(fine[1]), change, largest, seconds))
        for handles in options.handles:
            start = time.process_time()
            body = body_of(mesh, loads, handles)
            u = simulated(body, mesh, loads, fine[0].points)
            error = relative_error(u, fine[0].at_points(fine[1]), fine[0].weights)
            rows.append((name, handles, body.basis.size, error, time.process_time() - start))
            curves.setdefault(name, []).append((handles, error))
            print(*rows[-1], flush=True)
    plot(curves, HERE / "simulation_truth.png")
    write_part(HERE / "RESULTS.md", markdown(references, rows))


def reference(mesh, loads: Loads):
    """Solutions on the mesh and on the refined one, the change between them in parts, and processor seconds."""
    start, material, found = time.process_time(), TISSUE.material, []
    fine, fine_loads = refined(mesh, loads)
    for one, load in ((mesh, loads), (fine, fine_loads)):
        space = Quadratic.of(one)
        found.append((space, solve(space, load, material.mu, material.lam)))
    shared = mesh.p.shape[1]  # vertices come first and stay where they are
    change = np.linalg.norm(found[1][1][:shared] - found[0][1][:shared]) / np.linalg.norm(found[1][1][:shared])
    return *found, float(change), time.process_time() - start


def plot(curves: dict[str, list[tuple[int, float]]], path: Path) -> None:
    """Error against the number of handles."""
    figure, axes = plt.subplots(figsize=(5, 3.2), constrained_layout=True)
    for name, points in curves.items():
        axes.loglog(*zip(*[(h, 100 * e) for h, e in points], strict=True), "o-", label=name)
    axes.axhline(8, color="0.6", linestyle="--", linewidth=1)
    axes.set(xlabel="handles", ylabel="rms error over the volume, %")
    ticks = sorted({h for points in curves.values() for h, _ in points})
    axes.set_xticks(ticks, [str(t) for t in ticks], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_yticks([1, 2, 4, 8, 16, 32], ["1", "2", "4", "8", "16", "32"])
    axes.legend(frameon=False)
    figure.savefig(path, dpi=130)


def markdown(references, rows) -> str:
    """The part of RESULTS.md."""
    threads, arguments = os.environ.get("OMP_NUM_THREADS"), " ".join(sys.argv[1:])
    command = f"OMP_NUM_THREADS={threads} python Testing/benchmarks/simulation_truth.py {arguments}".strip()
    lines = [
        "# Simulator against full finite elements",
        "",
        __doc__.strip().splitlines()[4],
        "",
        *machine_lines(command),
    ]
    lines += [
        "",
        "The reference, quadratic tetrahedra: nodes, change of the vertices' displacement by the last refinement.",
        "",
    ]
    lines += [
        "| load | nodes | refined | change | largest displacement, mm | processor s |",
        "|---|---|---|---|---|---|",
    ]
    lines += [f"| {n} | {a} | {b} | {100 * c:.2f} % | {d:.1f} | {s:.0f} |" for n, a, b, c, d, s in references]
    lines += [
        "",
        "| load | handles | columns | rms error over the volume | processor s (body and solution) |",
        "|---|---|---|---|---|",
    ]
    lines += [f"| {n} | {h} | {c} | {100 * e:.1f} % | {s:.0f} |" for n, h, c, e, s in rows]
    return "\n".join([*lines, "", "![convergence](simulation_truth.png)"])


if __name__ == "__main__":
    main()
