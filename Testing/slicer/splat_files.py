"""Small PLY files for the tests: Gaussians, coloured points, a mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np


def write_gaussians(path: Path, centres, *, opacities, log_scales, colours=None) -> Path:
    """INRIA layout as given, also with numbers that are not finite; colours (N, 3) in 0..1, default grey."""
    count = len(centres)
    shades = np.zeros((count, 3)) if colours is None else (np.asarray(colours) - 0.5) / 0.28209479177387814
    logits = np.log(opacities / (1 - np.asarray(opacities)))
    names = ["x", "y", "z", *(f"f_dc_{k}" for k in range(3)), "opacity"]
    names += [*(f"scale_{k}" for k in range(3)), *(f"rot_{k}" for k in range(4))]
    turn = np.tile([2.0, 0.0, 0.0, 0.0], (count, 1))
    rows = np.column_stack([centres, shades, logits, log_scales, turn]).astype("<f4")
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    lines += [f"property float {name}" for name in names] + ["end_header", ""]
    path.write_bytes("\n".join(lines).encode() + rows.tobytes())
    return path


def write_points(path: Path, centres) -> Path:
    """A plain coloured point cloud, ASCII; point k has the colour (k, 2k, 3k)."""
    lines = ["ply", "format ascii 1.0", f"element vertex {len(centres)}"]
    lines += [f"property float {name}" for name in "xyz"]
    lines += [f"property uchar {name}" for name in ("red", "green", "blue")] + ["end_header"]
    lines += [f"{x:.6f} {y:.6f} {z:.6f} {k} {2 * k} {3 * k}" for k, (x, y, z) in enumerate(centres)]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_mesh(path: Path) -> Path:
    """A triangle."""
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {name}" for name in "xyz")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    path.write_text("\n".join([*lines, "0 0 0", "1 0 0", "0 1 0", "3 0 1 2"]) + "\n")
    return path
