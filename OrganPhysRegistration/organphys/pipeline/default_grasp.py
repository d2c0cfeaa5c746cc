"""A grasp and lift of the middle of an organ's seen side, its far side held, for when neither is said."""

from __future__ import annotations

import numpy as np

from ..asset.registered_organ import RegisteredOrgan
from ..asset.surface_distance import vertex_normals
from ..ground.checks import Array, InputError
from ..points.trajectory import Trajectory, rotation_along
from ..simulation.body import Body
from ..simulation.organ_body import metres_per_unit
from ..simulation.pins import Pin

OPEN_DEG, AWAY, DEPTH, LIFT = 60.0, 0.02, 0.007, 0.018  # degrees; m before the surface, below it, and up
# seconds, way from AWAY (0) to DEPTH (1), lift (0..1), jaws (0 closed..1 open)
KEYS = ((0.0, 0, 0, 1), (0.6, 1, 0, 1), (0.9, 1, 0, 0), (1.7, 1, 1, 0), (2.0, 1, 1, 0))
HELD = 0.12  # of the surface's vertices
EVEN = 0.012  # m: the surface's direction is the mean over this far


def default_grasp(body: Body, camera: Array, trocar: Array) -> Trajectory:
    """Tip poses in metres: in from ``trocar`` (3,) m, closed on the tissue, and lifted along the surface's normal.

    The spot lies near the middle of the side that camera (3,) m and trocar both see, where it faces both.
    """
    vertices, faces = body.samples.vertices, body.samples.faces
    normals = vertex_normals(vertices, faces)
    views = [_unit(place - vertices) for place in (camera, trocar)]
    facing = np.min([(normals * view).sum(1) for view in views], axis=0)
    seen = np.flatnonzero(facing > 0.3)
    if not len(seen):
        raise InputError("default grasp: camera and trocar see no part of the organ in common; give --trajectory")
    away = np.linalg.norm(vertices[seen] - vertices[seen].mean(0), axis=1)
    spot = vertices[seen[(facing[seen] - away / away.mean()).argmax()]]
    around = np.linalg.norm(vertices - spot, axis=1) < EVEN
    up, forward = _unit(normals[around].sum(0)), _unit(spot - trocar)
    keys = np.array(KEYS, dtype=np.float64)
    along = -AWAY + keys[:, 1] * (AWAY + DEPTH)
    positions = spot + along[:, None] * forward + LIFT * keys[:, 2, None] * up
    rotation = rotation_along(forward, 0.0)
    return Trajectory(keys[:, 0], positions, np.tile(rotation, (len(keys), 1, 1)), OPEN_DEG * keys[:, 3], "m")


def far_side_pin(organ: RegisteredOrgan, camera: Array) -> Pin:
    """A pin that holds the end of the organ farthest from the camera (3,) m, about an eighth of its surface."""
    vertices = organ.scene_vertices * metres_per_unit(organ)
    sight = _unit(vertices.mean(0) - camera)
    end = vertices[(vertices @ sight).argmax()]
    radius = float(np.quantile(np.linalg.norm(vertices - end, axis=1), HELD))
    return Pin(tuple(end.tolist()), radius)


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit
