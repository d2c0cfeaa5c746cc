"""What local detail buys: a pressed patch beside full finite elements refined round it.

    OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_detail.py

The ellipsoid of simulation_truth.py, held over one half, is pressed in by 0.3 N spread over a ball of 6 mm just below
its top, as a tool of some 3 mm radius would. Errors are rms over the tissue within 15 mm of that place, in parts of the
rms displacement there; sunk: mean displacement under the load, and of the surface 12 mm beside it. The kernels of local
detail lie on a lattice that is fixed in the tissue, so the load is put at four places of it. What it costs is in the
rows "local" of "Speed of the simulator". Writes its part of RESULTS.md.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from results_file import machine_lines, write_part
from skfem import MeshTet

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "core"))
from fem_reference import Loads, Quadratic, boundary, carried_over, solve  # noqa: E402
from truth_examples import TISSUE, body_of, load_case, mesh_of, simulated  # noqa: E402

from organphys.simulation.local_detail import LocalDetail, with_detail  # noqa: E402

BALL, FORCE = 0.006, 0.3  # m, N
NEAR, BESIDE = 0.015, 0.012  # m
FINER = (0.03, 0.02, 0.016, 0.012)  # m: tetrahedra with their middles so near are cut, one after the other
ONCE_MORE = 0.02  # m, for the reference whose change is told
PLACES = 4


class Reference(NamedTuple):
    """Mesh and its load, points (N, 3) m with weights (N,), true displacements (N, 3) m, those one refinement coarser,
    nodes of both."""

    mesh: MeshTet
    loads: Loads
    points: np.ndarray
    weights: np.ndarray
    truth: np.ndarray
    coarser: np.ndarray
    nodes: tuple[int, int]


def main() -> None:
    mesh = mesh_of(4)
    vertices = boundary(mesh)[0]
    top = vertices[vertices[:, 2].argmax()]
    known = reference(mesh, top)
    rows = [row("finite elements", known, known.truth, top), row("one refinement less", known, known.coarser, top)]
    for handles, quadrature in ((20, 1000), (60, 6000)):
        rows.append(simulated_row(mesh, known, top, handles, quadrature))
    shifts = LocalDetail().spacing * np.random.default_rng(0).uniform(size=(PLACES, 3))
    rows += [simulated_row(mesh, known, top, 20, 1000, shift) for shift in shifts]
    write_part(HERE / "RESULTS.md", markdown(known, rows))
    print("\n".join(rows))


def reference(mesh: MeshTet, top: np.ndarray) -> Reference:
    """Finite elements on the mesh refined round ``top`` (3,) m, and refined there once more."""
    coarse = mesh
    for radius in FINER:
        coarse = cut(coarse, top, radius)
    fine = cut(coarse, top, ONCE_MORE)
    spaces, material, loads = (Quadratic.of(coarse), Quadratic.of(fine)), TISSUE.material, pressed(mesh, fine, top)
    first = solve(spaces[0], loads, material.mu, material.lam)
    carried = carried_over(spaces[0], first, spaces[1])
    second = solve(spaces[1], loads, material.mu, material.lam, start=carried)
    found = (spaces[1].at_points(second), spaces[1].at_points(carried))
    return Reference(fine, loads, spaces[1].points, spaces[1].weights.ravel(), *found, (len(first), len(second)))


def cut(mesh: MeshTet, place: np.ndarray, radius: float) -> MeshTet:
    """The mesh with the tetrahedra cut whose middles are within ``radius`` m of ``place`` (3,)."""
    away = np.linalg.norm(mesh.p[:, mesh.t].mean(1).T - place, axis=1)
    return mesh.refined(np.flatnonzero(away < radius))


def pressed(mesh: MeshTet, fine: MeshTet, top: np.ndarray) -> Loads:
    """Springs over one half, and the force in a ball below ``top`` (3,) m, smooth in space."""
    space = Quadratic.of(fine)
    total = float(space.weights.ravel() @ bump(space.points, top))
    return Loads(load_case(mesh, "weight").held, lambda x: np.outer(bump(x, top), [0, 0, -FORCE]) / total)


def bump(x: np.ndarray, top: np.ndarray) -> np.ndarray:
    """1 in the middle of the ball, 0 from its edge on, at points (N, 3) m."""
    return np.clip(1 - ((x - top + [0, 0, 0.5 * BALL]) ** 2).sum(1) / BALL**2, 0, 1) ** 3


def simulated_row(mesh, known: Reference, top, handles: int, quadrature: int, shift=None) -> str:
    """A row of the simulator; with ``shift`` (3,) m all is moved so far beside the lattice of the local detail."""
    name, way = f"{handles} handles", np.zeros(3) if shift is None else shift
    moved = MeshTet(mesh.p + way[:, None], mesh.t)
    fine = MeshTet(known.mesh.p + way[:, None], known.mesh.t)
    loads = Loads(lambda x: known.loads.held(x - way), lambda x: known.loads.force(x - way))
    body = body_of(moved, loads, handles, quadrature)
    if shift is not None:
        name, body = f"{name}, local detail", with_detail(body, top + way, LocalDetail())
    u = simulated(body, fine, loads, known.points + way)
    return row(name, known, u, top, f"{body.basis.size}", f"{len(body.strain.weights)}")


def row(name: str, known: Reference, u: np.ndarray, top: np.ndarray, columns: str = "", points: str = "") -> str:
    """A line of the table for displacements (N, 3) m at the reference's points."""
    x, near = known.points, np.linalg.norm(known.points - top, axis=1) < NEAR
    squares = [known.weights[near] @ (v**2).sum(1)[near] for v in (u - known.truth, known.truth)]
    under = bump(x, top) > 0.6
    away = np.linalg.norm((x - top)[:, :2], axis=1)
    beside = (np.abs(away - BESIDE) < 0.003) & (x[:, 2] > top[2] - 0.004)
    sunk = [-1e3 * float(u[some, 2].mean()) for some in (under, beside)]
    cells = [f"{100 * np.sqrt(squares[0] / squares[1]):.1f} %", *(f"{s:.2f}" for s in sunk), f"{sunk[0] - sunk[1]:.2f}"]
    return "| " + " | ".join([name, columns, points, *cells]) + " |"


def markdown(known: Reference, rows: list[str]) -> str:
    """The part of RESULTS.md."""
    command = "OMP_NUM_THREADS=1 python Testing/benchmarks/simulation_detail.py"
    lines = ["# Local detail beside finite elements", "", *__doc__.strip().splitlines()[4:9], ""]
    lines += [*machine_lines(command), f"- nodes of the reference: {known.nodes[1]}, {known.nodes[0]} before", ""]
    lines += ["| simulator | columns | points | error near | sunk under the load, mm | 12 mm beside, mm | dimple, mm |"]
    return "\n".join([*lines, "|---" * 7 + "|", *rows])


if __name__ == "__main__":
    main()
