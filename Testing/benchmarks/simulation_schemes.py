"""Orders of the time schemes, and the simulator beside finite elements and another simulator, step by step.

    OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_schemes.py [--handles 10 20 32 40]

Orders: a damped box, held at one end, sags for 64 ms; the error at the end is against 1024 steps of BDF2. Beam and
cube: ``shared/fem`` beside the repository, vertices after step 1 and step 100 of 50 ms; the figures beside ours are
those given there (Simplicits with 32 handles, 1024 nodes and 1000 quadrature points). The cube is scored before it
lands.

Writes its part of RESULTS.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from results_file import machine_lines, write_part

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "core"))
from outside_fem import FEM, beam_errors, cube_error, reference  # noqa: E402
from simulation_examples import box_body  # noqa: E402

from organphys.simulation.options import SimulationOptions, gravity_along  # noqa: E402
from organphys.simulation.pins import Pin  # noqa: E402
from organphys.simulation.scene import Scene  # noqa: E402
from organphys.simulation.step import step  # noqa: E402

LASTS = 0.064  # s
COUNTS, MANY = (8, 16, 32, 64, 128), 1024
SCHEMES = {"backward Euler": "backward_euler", "BDF2": "bdf2"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--handles", type=int, nargs="+", default=[10, 20, 32, 40])
    options = parser.parse_args()
    command = " ".join(["OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_schemes.py", *sys.argv[1:]])
    lines = ["# Time schemes, and step by step beside finite elements", "", *__doc__.strip().splitlines()[4:8], ""]
    lines += [*machine_lines(command), "", *order_table(), ""]
    if FEM.is_dir():
        lines += beam_table(options.handles)
    write_part(HERE / "RESULTS.md", "\n".join(lines))
    print("\n".join(lines))


def order_table() -> list[str]:
    """Error at the end, in parts of the displacement, and order from one halving of the step to the next."""
    truth = swung("bdf2", MANY)
    errors = {
        name: [np.linalg.norm(swung(scheme, n) - truth) / np.linalg.norm(truth) for n in COUNTS]
        for name, scheme in SCHEMES.items()
    }
    lines = ["| time step, ms | " + " | ".join(f"{name}: error | order" for name in errors) + " |", "|---" * 5 + "|"]
    for k, count in enumerate(COUNTS):
        cells = [f"{1e3 * LASTS / count:.1f}"]
        for one in errors.values():
            cells += [f"{100 * one[k]:.4f} %", f"{np.log2(one[k - 1] / one[k]):.2f}" if k else ""]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def swung(scheme: str, count: int) -> np.ndarray:
    """Coordinates (n, 3) of the box after ``count`` steps."""
    body = box_body(Pin((0.0, 0.02, 0.02), 0.032))
    gravity = gravity_along([0, 0, -1])
    options = SimulationOptions(gravity=gravity, scheme=scheme, mass_damping=1, stiffness_damping=0.02, tolerance=1e-8)
    scene = Scene((body,), options=options)
    state = scene.initial_state()
    for _ in range(count):
        state, _ = step(scene, state, (), LASTS / count)
    return state.bodies[0].z


def beam_table(handles: list[int]) -> list[str]:
    """Vertex rms errors, m."""
    beam, cube = reference("beam"), reference("cube")
    lines = ["| simulator | handles | beam, step 1, m | beam, step 100, m | cube, step 1, m |", "|---" * 5 + "|"]
    for count in handles:
        found = beam_errors(beam, count, (1, 100))
        lines.append(f"| ours | {count} | {found[1]:.5f} | {found[100]:.4f} | {cube_error(cube, count):.1e} |")
    lines.append("| given with the reference | 32 | 0.0007 | 0.0272 | 0.0005 |")
    largest = [float(np.linalg.norm(fem["v_end"] - fem["v0"], axis=1).max()) for fem in (beam, cube)]
    return [*lines, "", f"Largest displacement after step 100: beam {largest[0]:.3f} m, cube {largest[1]:.3f} m."]


if __name__ == "__main__":
    main()
