"""The registered organ: carried by a model node of a case, or read from an .organphys file into such a node."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import slicer
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.asset.asset_file import asset_from_bytes
from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.checks import InputError
from OrganPhysRegistrationLib.inputs.matrices import ROLE
from OrganPhysRegistrationLib.inputs.splat_scale import UPRIGHT
from OrganPhysRegistrationLib.outputs.case_record import CaseNodes
from OrganPhysRegistrationLib.outputs.geometry import point_cloud
from OrganPhysRegistrationLib.outputs.volume_node import ASSET

ORGAN_ROLE = "volume"  # of OrganPhysRegistration's model of displaced volume points


def load_organ(path: str | Path) -> Any:
    """A hidden model node that carries the organ of an .organphys file; InputError says what is wrong with the file."""
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); choose an .organphys file") from error
    organ = asset_from_bytes(content, name=str(path))
    points = organ.map_points(organ.volume_points[:2000]) @ UPRIGHT.T * organ.mm_per_unit
    cloud = point_cloud(points)
    data = numpy_to_vtk(np.frombuffer(content, dtype=np.uint8), deep=True)
    data.SetName(ASSET)
    cloud.GetFieldData().AddArray(data)
    node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLModelNode", slicer.mrmlScene.GenerateUniqueName(organ.name))
    node.SetAttribute(ROLE, ORGAN_ROLE)
    node.SetAndObserveMesh(cloud)
    node.CreateDefaultDisplayNodes()
    node.GetDisplayNode().SetVisibility(False)
    return node


def organ_bytes(node: Any) -> bytes:
    """The .organphys bytes a node carries. InputError: none chosen, or it carries none."""
    if node is None:
        raise InputError(
            "organ: none chosen; register one in OrganPhys Registration, load an .organphys file, or take "
            "the sample data"
        )
    data = None if node.GetPolyData() is None else node.GetPolyData().GetFieldData().GetArray(ASSET)
    if data is None:
        raise InputError(
            f"organ: {node.GetName()} carries no registered organ; run the elastic stage, or load an .organphys file"
        )
    return vtk_to_numpy(data).astype(np.uint8).tobytes()


def organ_of(node: Any) -> RegisteredOrgan:
    """The organ a node carries, checked as a file is. InputError: none, damaged, or of another version."""
    content = organ_bytes(node)
    return asset_from_bytes(content, name=node.GetName())


def case_of_organ(node: Any) -> CaseNodes | None:
    """The registration's case that the node belongs to, None for a loaded file."""
    name = None if node is None else node.GetAttribute("OrganPhys.Case")
    return CaseNodes.find(case_id=name) if name else None


def splat_of_organ(node: Any) -> Any:
    """The splat that the organ was registered onto, None if it is not in the scene."""
    case = case_of_organ(node)
    return None if case is None or case.get("case") is None else case.splat
