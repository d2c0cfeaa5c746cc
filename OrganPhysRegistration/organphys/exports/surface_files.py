"""Surface files for other programs: STL, OBJ, PLY and VTP, each saying its frame and unit where the format can."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..ground.atomic_file import write_bytes
from ..ground.checks import one_of
from .surface_mesh import FRAMES, SurfaceMesh
from .vtk_xml import polydata_bytes


def write_surface(path: str | os.PathLike[str], mesh: SurfaceMesh, *, format: str = "") -> None:
    """Write the surface, atomically; ``format``: "stl" (no colours), "obj", "ply" or "vtp"; else the file's ending.

    InputError for another format or a file that cannot be written.
    """
    chosen = one_of(format or Path(path).suffix.lower().lstrip("."), "surface format", tuple(WRITERS))
    WRITERS[chosen](path, mesh)


def _write_stl(path: str | os.PathLike[str], mesh: SurfaceMesh) -> None:
    """Binary STL; its 80 bytes of header tell the frame (STL has neither units nor colours)."""
    corners = mesh.vertices[mesh.faces].astype("<f4")
    rows = np.zeros(len(corners), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rows["normal"] = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    rows["corners"] = corners
    header = mesh.comment.encode("ascii", "replace")[:80].ljust(80)
    write_bytes(path, header + np.uint32(len(rows)).astype("<u4").tobytes() + rows.tobytes())


def _write_obj(path: str | os.PathLike[str], mesh: SurfaceMesh) -> None:
    """Text OBJ; colours follow the coordinates of each vertex, as MeshLab and Blender read them."""
    stream = io.StringIO()
    stream.write(f"# {mesh.comment}\n")
    columns, form = mesh.vertices, ["%.7g"] * 3
    if mesh.colours is not None:
        columns, form = np.concatenate([columns, mesh.colours / 255], axis=1), [*form, *["%.4g"] * 3]
    np.savetxt(stream, columns, fmt="v " + " ".join(form))
    np.savetxt(stream, mesh.faces + 1, fmt="f %d %d %d")
    write_bytes(path, stream.getvalue().encode("utf-8"))


def _write_ply(path: str | os.PathLike[str], mesh: SurfaceMesh) -> None:
    """Binary PLY with a comment; colours as uchar red, green, blue."""
    kinds = [(axis, "<f4") for axis in "xyz"]
    if mesh.colours is not None:
        kinds += [(name, "u1") for name in ("red", "green", "blue")]
    rows = np.empty(len(mesh.vertices), dtype=kinds)
    for k, axis in enumerate("xyz"):
        rows[axis] = mesh.vertices[:, k]
    for k, (name, _) in enumerate(kinds[3:]):
        rows[name] = mesh.colours[:, k]  # type: ignore[index]
    faces = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    header = ["ply", "format binary_little_endian 1.0", f"comment {mesh.comment}", f"element vertex {len(rows)}"]
    header += [f"property {'float' if kind == '<f4' else 'uchar'} {name}" for name, kind in kinds]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    write_bytes(path, "\n".join(header).encode("ascii", "replace") + rows.tobytes() + faces.tobytes())


def _write_vtp(path: str | os.PathLike[str], mesh: SurfaceMesh) -> None:
    """VTK XML PolyData; field data SPACE=RAS (3D Slicer then does not mirror it) and FRAME; colours as point scalars.

    VTK is loaded here and without any rendering module.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints, vtkStringArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    points, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(mesh.vertices), deep=True))
    offsets = np.arange(0, 3 * len(mesh.faces) + 1, 3, dtype=np.int64)
    cells.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(mesh.faces.ravel(), deep=True))
    data.SetPoints(points)
    data.SetPolys(cells)
    if mesh.colours is not None:
        colours = numpy_to_vtk(np.ascontiguousarray(mesh.colours), deep=True)
        colours.SetName("RGB")
        data.GetPointData().SetScalars(colours)
    for name, value in (("SPACE", "RAS"), ("FRAME", FRAMES[mesh.frame])):
        text = vtkStringArray()
        text.SetName(name)
        text.InsertNextValue(value)
        data.GetFieldData().AddArray(text)
    write_bytes(path, polydata_bytes(data))


WRITERS: dict[str, Callable[[str | os.PathLike[str], SurfaceMesh], None]] = {
    "stl": _write_stl,
    "obj": _write_obj,
    "ply": _write_ply,
    "vtp": _write_vtp,
}
