"""Files of a case: the registered surface, the asset, the transform. All of it works from a loaded scene as well."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import slicer
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.atomic_file import atomic_path, write_bytes
from organphys.ground.checks import InputError, one_of

from ..inputs.matrices import array_of, matrix_of
from .case_record import CaseNodes
from .geometry import Array
from .grid_transforms import grid_in, like_grid
from .overlay_frame import world_from
from .volume_node import asset_bytes

FRAMES = ("world", "scene")
SURFACES, TRANSFORMS = (".stl", ".ply", ".vtp"), (".h5", ".nrrd")


def export_surface(
    case: CaseNodes, path: str | os.PathLike[str], *, stage: str | None = None, frame: str = "world"
) -> None:
    """Write a stage's surface (None: the last one) as .stl, .ply or .vtp.

    frame: "world" is RAS mm where the endoscope saw the organ, "scene" the splat's raw units. The file says that it
    is not to be turned from LPS to RAS. .ply and .vtp carry distance_mm; .vtp all point arrays.
    """
    one_of(frame, "frame", FRAMES)
    suffix = _suffix(path, SURFACES, "surface")
    node = case.node(f"surface_{stage or case.stage}")
    matrix = np.linalg.inv(np.array(case.record["T_overlay_scene"])) if frame == "scene" else _T_world_overlay(case)
    mesh = _moved(node.GetPolyData(), matrix)
    holder, storage = slicer.vtkMRMLModelNode(), slicer.vtkMRMLModelStorageNode()
    holder.SetAndObserveMesh(mesh)
    storage.SetCoordinateSystem(slicer.vtkMRMLStorageNode.CoordinateSystemRAS)
    storage.SetUseCompression(suffix == ".vtp")
    with atomic_path(path) as temporary:
        storage.SetFileName(str(temporary))
        if not storage.WriteData(holder):
            raise InputError(f"{path}: cannot be written; choose a folder that you may write to")


def export_asset(case: CaseNodes, path: str | os.PathLike[str]) -> None:
    """Write the .organphys file of the elastic result, for the simulator and the command line."""
    _suffix(path, (".organphys",), "asset")
    write_bytes(path, asset_bytes(case))


def export_transform(case: CaseNodes, path: str | os.PathLike[str], *, inverse: bool = False) -> None:
    """Write CT to scene (``inverse``: scene to CT), RAS mm of the endoscope frame, as Slicer reads it back.

    .h5: similarity and elastic grid, valid everywhere. .nrrd: the whole displacement on the grid round the organ, valid
    within it only; for the elastic CT to scene transform. Between the nodes Slicer is as exact as the metrics table's
    sampling error says, a program that interpolates linearly as its linear one.
    """
    suffix = _suffix(path, TRANSFORMS, "transform")
    source = case.node("scene_to_ct" if inverse else "ct_to_scene")
    if suffix == ".nrrd":
        if inverse:
            raise InputError("the inverse as .nrrd is not offered; write it as .h5")
        node = slicer.vtkMRMLGridTransformNode()
        node.SetAndObserveTransformToParent(_whole_displacement(source))
    else:
        node = slicer.vtkMRMLTransformNode()
        node.SetAndObserveTransformToParent(source.GetTransformToParent())
    storage = slicer.vtkMRMLTransformStorageNode()
    with atomic_path(path) as temporary:
        storage.SetFileName(str(temporary))
        if not storage.WriteData(node):
            raise InputError(f"{path}: cannot be written; choose a folder that you may write to")


def _whole_displacement(node: Any) -> Any:
    """Grid transform that does alone, within the elastic grid, what grid and similarity do one after the other."""
    grid, transform = grid_in(node), node.GetTransformToParent()
    if grid is None:
        raise InputError("only an elastic result has a displacement grid; write the transform as .h5")
    image, turn = vtk.vtkImageData(), grid.GetGridDirectionMatrix()
    image.CopyStructure(grid.GetDisplacementGrid())
    places = vtk.vtkPoints()
    places.SetData(numpy_to_vtk(_nodes_of(image, turn), deep=True))
    moved = vtk.vtkPoints()
    moved.SetDataTypeToDouble()
    transform.TransformPoints(places, moved)
    vectors = vtk_to_numpy(moved.GetData()) - vtk_to_numpy(places.GetData())
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(vectors), deep=True))
    return like_grid(grid, image)


def _nodes_of(image: Any, turn: Any) -> Array:
    """Positions (N, 3) of an oriented grid's nodes, x fastest, RAS mm."""
    i, j, k = (np.arange(n) * step for n, step in zip(image.GetDimensions(), image.GetSpacing(), strict=True))
    z, y, x = np.meshgrid(k, j, i, indexing="ij")
    offsets = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    if turn is not None:
        offsets = offsets @ array_of(turn)[:3, :3].T
    return np.ascontiguousarray(offsets + image.GetOrigin())


def _moved(mesh: Any, matrix: Array) -> Any:
    to_file = vtk.vtkTransform()
    to_file.SetMatrix(matrix_of(matrix))
    mover = vtk.vtkTransformPolyDataFilter()
    mover.SetTransform(to_file)
    mover.SetInputData(mesh)
    mover.Update()
    return mover.GetOutput()


def _T_world_overlay(case: CaseNodes) -> Array:
    """The overlay frame as the endoscope saw it: its own matrix left out, parents that the user gave kept."""
    return world_from(case.node("overlay_frame").GetParentTransformNode())


def _suffix(path: str | os.PathLike[str], allowed: tuple[str, ...], what: str) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in allowed:
        raise InputError(f"{path}: a {what} is written as {', '.join(allowed)}")
    return suffix
