"""report.html of a case, from its nodes alone."""

from __future__ import annotations

import os
from types import SimpleNamespace
from typing import Any

import numpy as np
from vtk.util.numpy_support import vtk_to_numpy

from organphys.ground.notices import Notice

from ..inputs.matrices import apply_matrix
from ..inputs.splat_node import splat_arrays
from .case_record import CaseNodes
from .charts import ALPHA, DRIFT, TO_CT
from .geometry import Array, points_of
from .surface_nodes import DISTANCE
from .volume_node import asset_of

OPAQUE = 0.1


def export_report(case: CaseNodes, path: str | os.PathLike[str]) -> None:
    """Write report.html of an elastic result. It lacks the drawing of the coarse stage, which the scene does not hold.

    InputError: not elastic, or the splat was deleted from the scene.
    """
    from organphys.exports.report import write_report

    write_report(path, _content(case))


def _content(case: CaseNodes) -> Any:
    from scipy.spatial import cKDTree

    from organphys.exports.report_content import ReportContent, StagePicture
    from organphys.points.point_sets import Camera

    organ, record = asset_of(case), case.record
    splat = splat_arrays(case.splat)
    opaque = splat.valid & (splat.opacities > OPAQUE)
    centres = splat.centres[opaque].astype(np.float64)
    stages = {stage: _scene_vertices(case, stage) for stage in case.stages}
    distances = vtk_to_numpy(case.node("surface_elastic").GetPolyData().GetPointData().GetArray(DISTANCE))
    return ReportContent(
        title=f"{case.name} registered to the splat",
        faces=organ.faces,
        vertices_ct=organ.vertices,
        stages=[StagePicture(name, at, distances if name == "elastic" else None) for name, at in stages.items()],
        splat_centres=centres,
        splat_colours=splat.colours[opaque],
        mm_per_unit=record["mm_per_unit"],
        camera=Camera(np.array(record["camera_position"])),
        verdict=_verdict(record.get("verdict")),
        errors_mm=None if organ.uncertainty is None else organ.surface_error_mm(0.95),
        notices=[Notice(code, message) for code, message in record["notices"]],
        inputs=list(record["facts"].items()),
        metrics=record["metrics"],
        seconds=record["seconds"],
        stops=record["stops"],
        steps=_steps(case),
        splat_to_ct_mm=cKDTree(stages["elastic"]).query(centres)[0] * record["mm_per_unit"],
        provenance=organ.provenance,
    )


def _verdict(entry: Any) -> Any:
    """The stored verdict as the report reads it; None for a case that was made without."""
    if not entry:
        return None
    reasons = [SimpleNamespace(**reason) for reason in entry["reasons"]]
    return SimpleNamespace(level=entry["level"], headline=entry["headline"], reasons=reasons)


def _scene_vertices(case: CaseNodes, stage: str) -> Array:
    T_scene_overlay = np.linalg.inv(np.array(case.record["T_overlay_scene"]))
    return apply_matrix(T_scene_overlay, points_of(case.node(f"surface_{stage}").GetPolyData()))


def _steps(case: CaseNodes) -> list[Any]:
    node = case.get("convergence_table")
    if node is None:
        return []
    columns = [vtk_to_numpy(node.GetTable().GetColumnByName(name)) for name in (ALPHA, TO_CT, DRIFT)]
    return [
        SimpleNamespace(alpha=a, trim30_splat_to_ct_mm=d, volume_drift_percent=v)
        for a, d, v in zip(*columns, strict=True)
    ]
