"""The simulator against full finite elements (quadratic tetrahedra, scikit-fem) on the same body, for more handles.

    OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_truth.py [--handles 6 10 20 40 60] [--cells 5]

Two loads on a liver-like ellipsoid (Neo-Hookean, E 5.5 kPa, nu 0.45), held by springs over one half: its own weight,
and its other end pulled aside. Errors are rms over the volume in parts of the rms displacement; beside them the error
of the best displacement that the same handles could make, which no elasticity and no quadrature enter.
Writes its part of RESULTS.md and the curves beside it.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from results_file import machine_lines, write_part

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "core"))
from fem_reference import Loads, Quadratic, carried_over, solve  # noqa: E402
from truth_examples import LOADS, TISSUE, body_of, load_case, mesh_of, relative_error, simulated  # noqa: E402

PER_HANDLE = 100  # quadrature points
AT_FORTY = (1000, 2000)  # other numbers of them, for 40 handles


class Reference(NamedTuple):
    """Fine space and displacement (N, 3) m at its points; nodes of both meshes, change between them in parts."""

    space: Quadratic
    truth: np.ndarray
    nodes: tuple[int, int]
    change: float
    seconds: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--handles", type=int, nargs="+", default=[6, 10, 20, 40, 60])
    parser.add_argument("--cells", type=int, default=5)
    options = parser.parse_args()
    rows, references = [], {}
    mesh = mesh_of(options.cells)
    for name in LOADS:
        loads = load_case(mesh, name)
        references[name] = reference(mesh, loads)
        print(name, *references[name][2:], flush=True)
        choices = [(handles, PER_HANDLE * handles) for handles in options.handles] + [(40, k) for k in AT_FORTY]
        for handles, quadrature in choices:
            start = time.process_time()
            errors = scored(mesh, loads, handles, quadrature, references[name])
            rows.append((name, handles, quadrature, *errors, time.process_time() - start))
            print(*rows[-1], flush=True)
    plot(rows, HERE / "simulation_truth.png")
    write_part(HERE / "RESULTS.md", markdown(references, rows))


def reference(mesh, loads: Loads) -> Reference:
    """Solution on the refined mesh, and its change from that on the mesh."""
    start, material = time.process_time(), TISSUE.material
    coarse, fine = Quadratic.of(mesh), Quadratic.of(mesh.refined())
    first = solve(coarse, loads, material.mu, material.lam)
    carried = carried_over(coarse, first, fine)
    second = solve(fine, loads, material.mu, material.lam, start=carried)
    truth = fine.at_points(second)
    change = relative_error(fine.at_points(carried), truth, fine.weights)
    return Reference(fine, truth, (len(first), len(second)), change, time.process_time() - start)


def scored(mesh, loads: Loads, handles: int, quadrature: int, known: Reference) -> tuple[int, float, float]:
    """Columns of the basis, error of the simulator, and that of the best displacement in its space."""
    space, truth = known.space, known.truth
    body = body_of(mesh, loads, handles, quadrature)
    error = relative_error(simulated(body, mesh, loads, space.points), truth, space.weights)
    phi, weights = body.basis.phi(space.points), space.weights.reshape(-1, 1)
    best = phi @ np.linalg.solve(phi.T @ (weights * phi), phi.T @ (weights * truth))
    return body.basis.size, error, relative_error(best, truth, space.weights)


def plot(rows, path: Path) -> None:
    """Errors against the number of handles."""
    figure, axes = plt.subplots(figsize=(5, 3.2), constrained_layout=True)
    for name, colour in zip(LOADS, ("C0", "C1"), strict=True):
        mine = [row for row in rows if row[0] == name and row[2] == PER_HANDLE * row[1]]
        axes.loglog([r[1] for r in mine], [100 * r[4] for r in mine], "o-", color=colour, label=name)
        axes.loglog([r[1] for r in mine], [100 * r[5] for r in mine], "o:", color=colour, label="best in the space")
    axes.axhline(8, color="0.6", linestyle="--", linewidth=1)
    axes.set(xlabel="handles", ylabel="rms error over the volume, %")
    ticks = sorted({row[1] for row in rows})
    axes.set_xticks(ticks, [str(t) for t in ticks], minor=False)
    axes.set_xticks([], minor=True)
    axes.set_yticks([0.1, 0.2, 0.5, 1, 2, 5, 10], ["0.1", "0.2", "0.5", "1", "2", "5", "10"])
    axes.legend(frameon=False, fontsize="small")
    figure.savefig(path, dpi=130)


def markdown(references: dict[str, Reference], rows) -> str:
    """The part of RESULTS.md."""
    threads, arguments = os.environ.get("OMP_NUM_THREADS"), " ".join(sys.argv[1:])
    command = f"OMP_NUM_THREADS={threads} python Testing/benchmarks/simulation_truth.py {arguments}".strip()
    lines = ["# Simulator against full finite elements", "", *__doc__.strip().splitlines()[4:7], ""]
    lines += [*machine_lines(command), ""]
    lines += [
        "The reference: nodes, rms change over the volume by its last refinement, and what is left of it, a third"
    ]
    lines += ["of that change where the error falls with the square of the edge at least.", ""]
    lines += ["| load | nodes | refined | change | left | largest displacement, mm | processor s |", "|---" * 7 + "|"]
    for name, known in references.items():
        largest = 1e3 * float(np.linalg.norm(known.truth, axis=1).max())
        lines += [
            f"| {name} | {known.nodes[0]} | {known.nodes[1]} | {100 * known.change:.2f} % | "
            f"{100 * known.change / 3:.2f} % | {largest:.1f} | {known.seconds:.0f} |"
        ]
    lines += ["", "| load | handles | quadrature points | columns | rms error | best in the space | processor s |"]
    lines += ["|---" * 7 + "|"]
    lines += [
        f"| {n} | {h} | {q} | {c} | {100 * e:.2f} % | {100 * b:.2f} % | {s:.0f} |" for n, h, q, c, e, b, s in rows
    ]
    return "\n".join([*lines, "", "![convergence](simulation_truth.png)"])


if __name__ == "__main__":
    main()
