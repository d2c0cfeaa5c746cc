"""Pictures of one registration, larger than in the report: every stage from the camera and from beside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..asset.surface_distance import vertex_normals
from ..exports.camera_view import View
from ..exports.mesh_thinning import thin_mesh
from ..exports.renderer import SplatLayer, overlay_picture, splat_picture
from ..exports.report_pictures import point_spacing
from .registration import Registration

WIDTH, HEIGHT = 480, 400
STAGES = {"coarse": "after the coarse stage", "rigid": "after the rigid stage", "elastic": "after the elastic stage"}


def stage_pictures(registration: Registration) -> list[list[tuple[str, NDArray[np.uint8]]]]:
    """Two rows (from the camera, from beside) of (caption, image): the splat alone, then the organ after each stage."""
    organ = registration.stage_points("elastic")
    thin = thin_mesh(registration.organ.vertices, registration.organ.faces, cells_across=96)
    front = View(registration.camera.position, organ.mean(0), np.array([0.0, 1.0, 0.0]), 1.0, WIDTH, HEIGHT)
    centres = np.asarray(registration.splat_points, dtype=np.float64)
    colours = np.asarray(registration.splat_colours, dtype=np.float64)
    rows = []
    for name, view in (("from the camera", front), ("from beside", front.turned(1, 65))):
        layer = SplatLayer(view.fitted(organ), centres, colours, 2.0 * point_spacing(centres))
        row = [(f"the splat, {name}", splat_picture(layer))]
        for stage, caption in STAGES.items():
            vertices = thin.averaged(registration.stage_points(stage))
            normals = vertex_normals(vertices, thin.faces)
            row.append((caption, overlay_picture(layer, vertices, thin.faces, normals=normals)))
        rows.append(row)
    return rows
