"""The displaced volume points; they carry the asset's bytes, so that the scene file alone is enough for exports."""

from __future__ import annotations

from typing import Any

import numpy as np
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from organphys.ground.checks import InputError

from ..inputs.matrices import apply_matrix
from .case_record import CaseNodes
from .geometry import Array, point_cloud, set_point_array
from .node_factory import ensure, remove_role

ASSET = "organphys_asset"


def write_volume(case: CaseNodes, outcome: Any, T_overlay_scene: Array, frame: Any) -> None:
    """Fill the volume points model (mm in the overlay frame), or remove it when the run was not elastic."""
    if outcome.volume_scene is None:
        remove_role(case, "volume")
        return
    fresh = case.get("volume") is None
    node = ensure(case, "volume")
    cloud = point_cloud(apply_matrix(T_overlay_scene, outcome.volume_scene))
    T_ct_scene = np.linalg.inv(np.asarray(outcome.similarities["elastic"]))
    moved = apply_matrix(T_ct_scene, outcome.volume_scene) - outcome.volume_ct
    set_point_array(cloud, "displacement_mm", np.linalg.norm(moved, axis=1))
    if outcome.asset is not None:
        data = numpy_to_vtk(np.frombuffer(outcome.asset, dtype=np.uint8), deep=True)
        data.SetName(ASSET)
        cloud.GetFieldData().AddArray(data)
    node.SetAndObserveMesh(cloud)
    node.SetAndObserveTransformNodeID(frame.GetID())
    if fresh:
        display = node.GetDisplayNode()
        display.SetVisibility(False)
        display.SetPointSize(2)
        display.SetColor(0.95, 0.75, 0.35)


def asset_bytes(case: CaseNodes) -> bytes:
    """The .organphys file's bytes. InputError if the elastic stage was not run or its node was deleted."""
    node = case.get("volume")
    data = None if node is None else node.GetPolyData().GetFieldData().GetArray(ASSET)
    if data is None:
        raise InputError("this case has no registered organ yet; run the elastic stage")
    return vtk_to_numpy(data).astype(np.uint8).tobytes()


def asset_of(case: CaseNodes) -> Any:
    """The case's ``organphys.RegisteredOrgan``, also after the scene was saved and loaded again."""
    from organphys.asset.asset_file import asset_from_bytes

    return asset_from_bytes(asset_bytes(case))
