"""Files of the present moment and of the recording."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import slicer
import vtk

from organphys.exports.gaussian_ply import write_gaussians
from organphys.exports.recording_file import save_recording
from organphys.ground.atomic_file import atomic_path
from organphys.ground.checks import InputError
from organphys.simulation.moved_splat import moved_splat
from organphys.simulation.session import Recording
from OrganPhysRegistrationLib.inputs.matrices import matrix_of

from ..engine.live_simulation import LiveSimulation
from ..inputs.splat_input import gaussians_of_file
from .frame_node import T_world_sim

SURFACES = (".stl", ".ply", ".vtp")


def export_surface(node: Any, frame: Any, path: str | os.PathLike[str]) -> None:
    """The surface as it is shown, RAS mm of the world, as .stl, .ply or .vtp."""
    if Path(path).suffix.lower() not in SURFACES:
        raise InputError(f"{path}: a surface is written as {', '.join(SURFACES)}")
    to_world = vtk.vtkTransform()
    to_world.SetMatrix(matrix_of(T_world_sim(frame)))
    mover = vtk.vtkTransformPolyDataFilter()
    mover.SetTransform(to_world)
    mover.SetInputData(node.GetPolyData())
    mover.Update()
    holder, storage = slicer.vtkMRMLModelNode(), slicer.vtkMRMLModelStorageNode()
    holder.SetAndObserveMesh(mover.GetOutput())
    storage.SetCoordinateSystem(slicer.vtkMRMLStorageNode.CoordinateSystemRAS)
    with atomic_path(path) as temporary:
        storage.SetFileName(str(temporary))
        if not storage.WriteData(holder):
            raise InputError(f"{path}: cannot be written; choose a folder that you may write to")


def export_splat(live: LiveSimulation, splat: Any, path: str | os.PathLike[str]) -> None:
    """The whole splat at this moment as an INRIA .ply, raw scene units: row i stays Gaussian i of the file."""
    binding = live.followers.binding
    if splat is None or binding is None:
        raise InputError("splat: the simulation runs without one; choose a splat and prepare again")
    if Path(path).suffix.lower() != ".ply":
        raise InputError(f"{path}: a splat is written as .ply")
    write_gaussians(Path(path), moved_splat(gaussians_of_file(splat), binding, live.body, live.z))


def export_recording(live: LiveSimulation, path: str | os.PathLike[str]) -> None:
    """All that was done since the beginning or the last reset, as .npz; ``organphys`` replays it."""
    if Path(path).suffix.lower() != ".npz":
        raise InputError(f"{path}: a recording is written as .npz")
    save_recording(path, recorded(live))


def recorded(live: LiveSimulation) -> Recording:
    """All that was done since the beginning or the last reset. InputError: nothing was."""
    recording = live.recording()
    if not recording.events:
        raise InputError("recording: nothing was simulated since the beginning, the last reset or a change of tissue")
    return recording
