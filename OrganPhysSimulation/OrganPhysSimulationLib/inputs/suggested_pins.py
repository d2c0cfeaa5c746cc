"""Pins where nobody said where the ligaments are: at the back of the organ, away from the endoscope."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.checks import Array
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix
from OrganPhysRegistrationLib.inputs.splat_scale import UPRIGHT

COUNT = 3
SOME = 3000
BACK = 0.25  # of the vertices, the farthest from the endoscope


def suggested_places(organ: RegisteredOrgan) -> Array:
    """Three places (3, 3), scene units, far apart on the back of the organ as the endoscope sees it."""
    vertices = some_vertices(organ)
    sight = vertices.mean(0) / max(float(np.linalg.norm(vertices.mean(0))), 1e-30)
    depth = vertices @ sight
    back = vertices[depth >= np.quantile(depth, 1 - BACK)]
    chosen = [int(np.argmax(back @ sight))]
    distance = np.full(len(back), np.inf)
    while len(chosen) < COUNT:
        distance = np.minimum(distance, ((back - back[chosen[-1]]) ** 2).sum(1))
        chosen.append(int(distance.argmax()))
    places: Array = back[chosen]
    return places


def some_vertices(organ: RegisteredOrgan) -> Array:
    """Some 3000 of the registered vertices (N, 3), scene units, quickly: no field beside the organ is baked."""
    points = organ.vertices[:: max(1, len(organ.vertices) // SOME)]
    vertices: Array = organ.T_scene_ct.apply(points + organ.deformation.inside_displacement(points))
    return vertices


def upright(organ: RegisteredOrgan) -> Array:
    """(4, 4) from scene units to the world where there is no splat: as the simulation's frame stands then."""
    matrix = np.eye(4)
    matrix[:3, :3] = UPRIGHT / organ.T_scene_ct.scale
    return matrix


def write_pins(node: Any, organ: RegisteredOrgan, T_world_scene: Array) -> Any:
    """Put the suggested pins into a list of points (None: a new one); that node."""
    if node is None:
        name = slicer.mrmlScene.GenerateUniqueName("Organ pins")
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLMarkupsFiducialNode", name)
        node.CreateDefaultDisplayNodes()
    node.RemoveAllControlPoints()
    for k, place in enumerate(apply_matrix(T_world_scene, suggested_places(organ))):
        node.AddControlPointWorld(*place.tolist(), f"pin {k + 1}")
    return node
