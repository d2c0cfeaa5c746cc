"""The numbers of a simulation as files: forces.csv for people, states.npz for programs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np

from ..ground.atomic_file import atomic_path, write_text
from ..ground.checks import Array
from ..simulation.body import Body
from ..simulation.state import ToolPose

STATES = {
    "time_s": "(F,) s, the start first",
    "vertices_m": "(Nv, 3) m, surface at rest, along the scene's axes",
    "faces": "(Nf, 3) int, corners, counter-clockwise from outside",
    "vertex_phi": "(Nv, n) 1, basis: the surface of frame f is vertices_m + vertex_phi @ z_m[f]",
    "z_m": "(F, n, 3) m, coordinates of the reduced model; without what --detail adds near the tool",
    "tool_position_m": "(F, 3) m, hinge of the jaws",
    "tool_rotation": "(F, 3, 3) 1, tool frame: z to the tip, x along the hinge",
    "jaw_deg": "(F,) deg, opening",
    "force_n": "(F, 3) N, of the tissue on the tool, scene axes, mean over the step",
    "torque_nm": "(F, 3) N m, about the hinge",
    "volume_ml": "(F,) ml",
    "metres_per_unit": "() m, of one scene unit of the splat",
    "about": "() text, this table",
}


def write_states(
    path: str | os.PathLike[str],
    body: Body,
    metres_per_unit: float,
    columns: Mapping[str, Sequence[object]],
    poses: Sequence[ToolPose],
) -> None:
    """Write states.npz, atomically; ``columns`` (F rows each): time_s, z_m, force_n, torque_nm, volume_ml.

    ``numpy.load`` reads it without pickle.
    """
    arrays = {
        **{name: np.array(values, dtype=np.float64) for name, values in columns.items()},
        "vertices_m": body.samples.vertices,
        "faces": body.samples.faces,
        "vertex_phi": body.vertex_phi.astype(np.float32),
        "tool_position_m": np.array([pose.position for pose in poses]),
        "tool_rotation": np.array([pose.rotation for pose in poses]),
        "jaw_deg": np.array([pose.jaw_deg for pose in poses]),
        "metres_per_unit": np.array(metres_per_unit),
        "about": np.array("\n".join(f"{name}: {text}" for name, text in STATES.items())),
    }
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]


def write_forces(path: str | os.PathLike[str], columns: Mapping[str, Sequence[object]]) -> None:
    """Write named columns (F rows each; (F, 3) as three columns _x, _y, _z) as CSV, six digits, atomically."""
    names: list[str] = []
    parts: list[Array] = []
    for name, values in columns.items():
        array = np.array(values, dtype=np.float64)
        names += [name] if array.ndim == 1 else [f"{name}_{axis}" for axis in "xyz"]
        parts.append(array.reshape(len(array), -1))
    rows = np.concatenate(parts, axis=1)
    lines = [",".join(names), *(",".join(f"{value:.6g}" for value in row) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")
