"""A Gaussian splat as a model node: raw scene coordinates, every Gaussian's fields as point arrays."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import slicer
import vtk
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import InputError
from organphys.ground.notices import Notice
from organphys.points.point_sets import GaussianCloud, SceneUnit

from .splat_columns import SplatColumns, read_columns
from .splat_display import COLOUR, create_display, show_gaussians
from .splat_scale import (
    GUESS_MM,
    T_shown_scene,
    T_world_scene,
    guess_scale,
    guessed_mm_per_unit,
    mm_per_unit_of,
    scene_to_world,
    set_scale,
)

__all__ = [
    "T_shown_scene",
    "T_world_scene",
    "checked_splat",
    "guess_scale",
    "is_splat",
    "load_splat",
    "mm_per_unit_of",
    "scene_to_world",
    "set_scale",
    "splat_arrays",
]

SPLAT = "OrganPhys.Splat"
NOTICES = "OrganPhys.Notices"
FRAME = "OpenCV camera: x right, y down, z forward; raw scene units"
ARRAYS = (COLOUR, "opacity", "scale", "rotation", "valid")
SHOWN_OPACITY = 0.1  # the paper's threshold, also what registration uses


def load_splat(
    path: str | Path, *, mm_per_unit: float | None = None, percent: float = 0.0, extent_mm: float = GUESS_MM
) -> Any:
    """Load a splat PLY as a vtkMRMLModelNode beside the CT, upright, in mm.

    ``mm_per_unit``: the stated unit, with ``percent`` standard deviation; without it the scale is guessed such that the
    splat measures ``extent_mm`` across. InputError: not readable, or no such unit; the scene is as before then.
    """
    unit = None if mm_per_unit is None else SceneUnit(mm_per_unit, percent)
    columns = read_columns(path)
    scene = slicer.mrmlScene
    node = scene.AddNewNodeByClass("vtkMRMLModelNode", scene.GenerateUniqueName(Path(path).stem or "Splat"))
    node.SetAndObserveMesh(polydata_of(columns))
    node.SetAttribute(SPLAT, "1")
    node.SetAttribute("OrganPhys.SplatFile", os.path.abspath(path))
    node.SetAttribute("OrganPhys.SceneFrame", FRAME)
    node.SetAttribute(NOTICES, json.dumps([[n.code, n.message] for n in columns.notices]))
    show_gaussians(node, columns.valid & (columns.opacities > SHOWN_OPACITY))
    create_display(node)
    if unit is None:
        set_scale(node, guessed_mm_per_unit(columns.centres, columns.opacities, extent_mm=extent_mm), "guess")
    else:
        set_scale(node, unit.mm_per_unit, "stated", percent=unit.percent)
    return node


def polydata_of(columns: SplatColumns) -> vtk.vtkPolyData:
    """Points in scene units with the arrays colour, opacity, scale, rotation and valid; no cells."""
    points, poly = vtk.vtkPoints(), vtk.vtkPolyData()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(columns.centres), deep=True))
    poly.SetPoints(points)
    values = (columns.colours, columns.opacities, columns.scales, columns.rotations, columns.valid.astype(np.uint8))
    for name, column in zip(ARRAYS, values, strict=True):
        array = numpy_to_vtk(np.ascontiguousarray(column), deep=True)
        array.SetName(name)
        poly.GetPointData().AddArray(array)
    poly.GetPointData().SetActiveScalars(COLOUR)
    return poly


def is_splat(node: Any) -> bool:
    """Whether a node (or None) is a splat loaded by this module, with its arrays."""
    if node is None or not node.IsA("vtkMRMLModelNode") or node.GetAttribute(SPLAT) != "1":
        return False
    poly = node.GetPolyData()
    return poly is not None and all(poly.GetPointData().HasArray(name) for name in ARRAYS)


def checked_splat(node: Any) -> Any:
    """The node, or InputError that says what to choose."""
    if node is None:
        raise InputError("splat: none chosen; load the Gaussian splat (.ply) or choose it")
    if not is_splat(node):
        raise InputError(f"splat: {node.GetName()} holds no Gaussians; load the splat's .ply file and choose it")
    return node


def splat_arrays(node: Any) -> GaussianCloud:
    """All Gaussians of the node in file order, raw scene units, as registration takes them (copies).

    centres (N, 3) float32, opacities (N,), colours (N, 3) in 0..1, valid (N,) bool, and what the file's reader noticed.
    """
    poly = checked_splat(node).GetPolyData()
    column = {name: vtk_to_numpy(poly.GetPointData().GetArray(name)) for name in ("opacity", "colour", "valid")}
    return GaussianCloud(
        centres=vtk_to_numpy(poly.GetPoints().GetData()).copy(),
        opacities=column["opacity"].copy(),
        colours=column["colour"].astype(np.float32) / np.float32(255),
        valid=column["valid"] != 0,
        notices=tuple(Notice(code, message) for code, message in json.loads(node.GetAttribute(NOTICES) or "[]")),
    )
