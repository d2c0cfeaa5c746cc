"""The organ surface after each stage, coloured by its distance to the splat."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import slicer

from ..inputs.matrices import apply_matrix
from .case_record import STAGES, CaseNodes
from .geometry import Array, cells, set_point_array, smooth_normals, triangle_mesh, turned
from .node_factory import ensure, remove_role
from .surface_colours import COLOURINGS, DET_F, DISPLACEMENT, DISTANCE, ERROR_68, ERROR_95, legend_of

__all__ = ["DISTANCE", "SurfaceNormals", "colour_limit_mm", "legend_of", "write_surfaces"]

STEPS_MM = (1.0, 2.0, 4.0, 6.0, 8.0, 10.0)  # beyond 10 mm a vertex has no counterpart in the splat
FEW = 20_000
FAR = (0.62, 0.62, 0.62)
# viridis (matplotlib, CC0) at nine places: even steps of lightness, safe for colour-blind eyes
COLOURS = np.array(
    [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99],
     [170, 220, 50], [253, 231, 37]]
)  # fmt: skip


@dataclass(frozen=True)
class SurfaceNormals:
    """Unit normals (Nv, 3) of the organ's surface as it is in the CT, and of the elastic one in scene axes, None where
    there is none: what takes longest of the surface models, and needs no node."""

    ct: Array
    elastic: Array | None

    @classmethod
    def of(cls, outcome: Any) -> SurfaceNormals:
        triangles, bent = cells(outcome.faces), outcome.surfaces.get("elastic")
        elastic = None if bent is None else smooth_normals(bent, triangles)
        return cls(smooth_normals(outcome.vertices_ct, triangles), elastic)


def write_surfaces(case: CaseNodes, outcome: Any, T_overlay_scene: Array, frame: Any, normals: SurfaceNormals) -> None:
    """Fill the surface models of all stages that are done, in the overlay frame's mm; remove those of others."""
    triangles, colours, limit = cells(outcome.faces), _colour_table(case), colour_limit_mm(outcome)
    for stage in STAGES:
        if stage not in outcome.surfaces:
            remove_role(case, f"surface_{stage}")
            continue
        fresh = case.get(f"surface_{stage}") is None
        node = ensure(case, f"surface_{stage}")
        if stage == "elastic":
            shading = turned(T_overlay_scene, normals.elastic)
        else:  # turned as a whole: much quicker than new ones
            shading = turned(T_overlay_scene @ np.asarray(outcome.similarities[stage]), normals.ct)
        mesh = triangle_mesh(apply_matrix(T_overlay_scene, outcome.surfaces[stage]), triangles, shading)
        for name, values in _arrays(outcome, stage).items():
            set_point_array(mesh, name, values)
        mesh.GetPointData().SetActiveScalars(DISTANCE)
        node.SetAndObserveMesh(mesh)
        node.SetAndObserveTransformNodeID(frame.GetID())
        if fresh:
            _style(node.GetDisplayNode(), colours)
        node.GetDisplayNode().SetScalarRangeFlag(slicer.vtkMRMLDisplayNode.UseManualScalarRange)
        node.GetDisplayNode().SetScalarRange(0.0, limit)
    case.update_record(distance_limit_mm=limit)


def colour_limit_mm(outcome: Any) -> float:
    """Upper end of the colours, mm: 95 % of the last stage's distances on the side that faces the camera, rounded up.

    The far side has no splat: its distances tell nothing about the fit and would press the rest into one colour.
    """
    distance = np.asarray(outcome.distance_mm[outcome.stage], dtype=np.float64)
    facing = _facing(outcome.surfaces[outcome.stage], outcome.faces, outcome.camera_position) & np.isfinite(distance)
    reached = np.percentile(distance[facing], 95) if facing.any() else STEPS_MM[-1]
    return next((step for step in STEPS_MM if step >= reached), STEPS_MM[-1])


def _arrays(outcome: Any, stage: str) -> Mapping[str, Any]:
    arrays = {DISTANCE: outcome.distance_mm[stage]}
    if stage == "elastic":
        arrays |= {DISPLACEMENT: outcome.displacement_mm, DET_F: outcome.det_f}
        errors = {ERROR_68: outcome.error_68_mm, ERROR_95: outcome.error_95_mm}
        arrays |= {name: values for name, values in errors.items() if values is not None}
    return arrays


def _facing(vertices: Array, faces: Any, camera: Any) -> Any:
    """Vertices (Nv,) bool of triangles that turn their outside to the camera (3,), of a sample of all triangles."""
    faces = faces[:: max(1, len(faces) // FEW)]  # a sample tells enough
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    towards = np.einsum("ij,ij->i", np.cross(b - a, c - a), np.asarray(camera) - a) > 0
    facing = np.zeros(len(vertices), dtype=bool)
    facing[faces[towards].ravel()] = True
    return facing


def _style(display: Any, colours: Any) -> None:
    display.SetActiveScalarName(DISTANCE)
    display.SetAndObserveColorNodeID(colours.GetID())
    display.SetScalarVisibility(True)
    display.SetVisibility2D(True)
    display.SetSliceIntersectionThickness(2)
    display.SetOpacity(0.75)
    display.SetVisibility(False)
    legend = slicer.modules.colors.logic().AddDefaultColorLegendDisplayNode(display)
    legend.SetTitleText(COLOURINGS[DISTANCE].title)
    legend.GetTitleTextProperty().SetFontSize(9)
    legend.GetLabelTextProperty().SetFontSize(10)
    legend.SetLabelFormat("%.3g")
    legend.SetMaxNumberOfColors(256)
    legend.SetNumberOfLabels(5)
    legend.SetSize(0.04, 0.25)  # of the view; Slicer fits the text to it, whatever its font size says
    legend.SetPosition(0.97, 0.06)
    legend.SetVisibility(False)


def _colour_table(case: CaseNodes) -> Any:
    """The case's own colour table: Slicer's own ones lie in files that not every installation has."""
    found = case.get("colours")
    if found is not None:
        return found
    node = ensure(case, "colours")
    node.SetTypeToUser()
    node.SetNumberOfColors(256)
    place = np.linspace(0, len(COLOURS) - 1, 256)
    ramp = np.stack([np.interp(place, np.arange(len(COLOURS)), COLOURS[:, k] / 255) for k in range(3)], axis=1)
    for index, colour in enumerate(ramp):
        node.SetColor(index, f"{index}", *map(float, colour), 1.0)
    node.SetColor(255, "farther", *FAR, 1.0)
    return node
