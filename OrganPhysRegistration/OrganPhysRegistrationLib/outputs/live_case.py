"""A live update into the scene: the elastic surface and its similarity, at once; the rest follows when all is still."""

from __future__ import annotations

from typing import Any

import numpy as np

from organphys.ground.checks import InputError

from ..inputs.matrices import apply_matrix
from .case_nodes import batch
from .case_record import CaseNodes
from .geometry import set_point_array, smooth_normals, triangle_mesh
from .surface_nodes import DET_F, DISPLACEMENT, DISTANCE
from .transform_nodes import write_transforms


def write_live(case: CaseNodes, outcome: Any) -> None:
    """Move the case's elastic surface to a ``CaseOutcome`` that holds this stage alone.

    The transforms become linear and are marked as not sampled. The nodes get new data objects, so that an undo finds
    the old ones. InputError where the case has no elastic surface any more.
    """
    node = case.get("surface_elastic")
    if node is None or node.GetMesh() is None:
        raise InputError("live update: the registered surface was removed from the scene; press Register")
    record = case.record
    with batch(case.scene):
        case.update_record(
            similarities=record["similarities"] | {"elastic": np.asarray(outcome.similarities["elastic"]).tolist()},
            metrics=record["metrics"] | {"elastic": _with_new(record["metrics"], outcome)},
            notices=[list(notice) for notice in outcome.notices],
            mm_per_unit=float(outcome.mm_per_unit),
        )
        _write_surface(node, outcome, np.array(record["T_overlay_scene"]))
        write_transforms(case, None)


def _with_new(metrics: Any, outcome: Any) -> dict[str, Any]:
    """Figures of the elastic stage; what an update does not tell, the confidence say, stays until all is still."""
    return {**metrics.get("elastic", {}), **outcome.metrics["elastic"]}


def _write_surface(node: Any, outcome: Any, T_overlay_scene: Any) -> None:
    """New points, normals and figures on the same triangles; colours and visibility stay."""
    triangles = node.GetMesh().GetPolys()
    vertices = apply_matrix(T_overlay_scene, outcome.surfaces["elastic"])
    mesh = triangle_mesh(vertices, triangles, smooth_normals(vertices, triangles))
    values = {DISTANCE: outcome.distance_mm["elastic"], DISPLACEMENT: outcome.displacement_mm, DET_F: outcome.det_f}
    for name, numbers in values.items():
        set_point_array(mesh, name, numbers)
    _keep_arrays(node.GetMesh(), mesh)
    shown = node.GetMesh().GetPointData().GetScalars()
    mesh.GetPointData().SetActiveScalars(DISTANCE if shown is None else shown.GetName())
    node.SetAndObserveMesh(mesh)


def _keep_arrays(old: Any, new: Any) -> None:
    """What an update does not tell, the confidence say, stays as it was until all is still."""
    for k in range(old.GetPointData().GetNumberOfArrays()):
        array = old.GetPointData().GetArray(k)
        if array is not None and new.GetPointData().GetArray(array.GetName()) is None:
            new.GetPointData().AddArray(array)
