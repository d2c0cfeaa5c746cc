"""Tetrahedral meshes as VTK .vtu and Gmsh .msh (version 2.2, text) through meshio, with frame and unit in a comment."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ..ground.atomic_file import atomic_path, write_bytes
from ..ground.checks import one_of
from .surface_mesh import FRAMES
from .tetrahedra import TetrahedralMesh, check_tetrahedra

FORMATS = {"vtu": "vtu", "msh": "gmsh22"}


def write_tetrahedra(
    path: str | os.PathLike[str], mesh: TetrahedralMesh, *, frame: str, name: str = "organ", format: str = ""
) -> None:
    """Write the mesh, atomically; ``format``: "vtu" or "msh", else the ending.

    vtu files carry radius_ratio per tetrahedron, Gmsh files physical group 1. InputError without meshio or for another
    format.
    """
    chosen = one_of(format or Path(path).suffix.lower().lstrip("."), "format of tetrahedra", tuple(FORMATS))
    check_tetrahedra()
    import meshio

    data: dict[str, list[Any]] = {"radius_ratio": [mesh.radius_ratios]}
    if chosen == "msh":  # meshio's element data in Gmsh text cannot be read again with numpy 2
        group = np.ones(len(mesh.cells), dtype=np.int32)
        data = {"gmsh:physical": [group], "gmsh:geometrical": [group]}
    content = meshio.Mesh(mesh.nodes, [("tetra", mesh.cells)], cell_data=data)
    with atomic_path(path) as temporary:
        if chosen == "msh":
            meshio.write(temporary, content, file_format="gmsh22", binary=False)
        else:
            meshio.write(temporary, content, file_format="vtu")
        text = temporary.read_bytes()
    words = f"organphys: {' '.join(name.split())}; {FRAMES[frame]}".replace("--", "-").encode("ascii", "replace")
    write_bytes(path, _with_comment(text, words, chosen))


def _with_comment(content: bytes, words: bytes, format: str) -> bytes:
    if format == "msh":
        return b"$Comments\n" + words + b"\n$EndComments\n" + content
    first, rest = content.split(b"\n", 1)
    return first + b"\n<!-- " + words + b" -->\n" + rest
