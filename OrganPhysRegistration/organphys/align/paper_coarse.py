"""Coarse alignment of the OrganPhys paper (section 3.3): scale from two extents, front to viewer, twist search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree
from scipy.spatial.distance import cdist

from ..ground.checks import Array, InputError, as_points, as_vector
from ..ground.frames import Similarity, rotation_about, rotation_between
from ..ground.progress import Progress, no_progress
from ..points.sampling import random_subset
from .metrics import trimmed_mean
from .records import CoarseView

COST_NAME = "trim30 mean distance CT to splat at the coarse scale, mm"


@dataclass(frozen=True)
class PaperCoarseOptions:
    """twists: angles tried about the viewing axis; surface_points: at most so many CT points are used."""

    twists: int = 12
    surface_points: int = 10_000
    seed: int = 0


def paper_coarse(
    surface: Array,
    target: Array,
    landmarks: Array,
    camera: Array,
    *,
    options: PaperCoarseOptions | None = None,
    progress: Progress = no_progress,
) -> tuple[Similarity, CoarseView]:
    """T_scene_ct and how it came about, from CT boundary points (S, 3) and landmarks (L, 3), both RAS mm.

    ``target`` (M, 3): Gaussian centres, scene units; ``camera`` (3,): its position in the scene. Translation puts the
    two centroids together, as the paper leaves it open.
    """
    options = options or PaperCoarseOptions()
    surface, target = as_points(surface, "CT surface points", minimum=4), as_points(target, "splat points", minimum=4)
    landmarks, camera = as_points(landmarks, "landmarks"), as_vector(camera, "camera position")
    surface = surface[random_subset(len(surface), options.surface_points, options.seed)]
    centre, target_centre = surface.mean(0), target.mean(0)
    front = _unit(landmarks.mean(0) - centre, "landmarks: their midpoint is the organ's centroid, pick visible points")
    viewer = _unit(camera - target_centre, "camera: it lies in the centroid of the splat, give its true position")
    segment, diameter = projected_diameter(surface, front)
    corners, extent = oriented_box(target)
    scale, turn = extent / diameter, rotation_between(front, viewer)

    tree, angles = cKDTree(target), 2 * np.pi * np.arange(options.twists) / options.twists
    costs, poses = np.empty(len(angles)), []
    for k, angle in enumerate(angles):
        progress("coarse", k / len(angles))
        rotation = rotation_about(viewer, angle) @ turn
        poses.append(Similarity(scale, rotation, target_centre - scale * (rotation @ centre)))
        costs[k] = trimmed_mean(tree.query(poses[-1].apply(surface))[0]) / scale
    best = int(costs.argmin())
    progress("coarse", 1.0)
    view = CoarseView(
        front_ct=front,
        viewer_scene=viewer,
        hull_segment_ct=segment,
        hull_diameter_mm=diameter,
        box_extent_scene=extent,
        box_corners_scene=corners,
        twists_deg=np.degrees(angles),
        twist_costs=costs,
        twist_cost_name=COST_NAME,
        chosen_twist_deg=float(np.degrees(angles[best])),
    )
    return poses[best], view


def projected_diameter(points: Array, axis: Array) -> tuple[Array, float]:
    """Farthest pair (2, 3) and its distance after projecting points (N, 3) on the plane perpendicular to ``axis``."""
    _, _, rows = np.linalg.svd(axis[None])
    flat = points @ rows[1:].T
    try:
        rim = ConvexHull(flat).vertices
    except QhullError as error:
        raise InputError("CT surface points: they lie on a line seen from the landmarks, check the label") from error
    distances = cdist(flat[rim], flat[rim])
    i, j = np.unravel_index(int(distances.argmax()), distances.shape)
    return points[rim[[i, j]]], float(distances[i, j])


def oriented_box(points: Array) -> tuple[Array, float]:
    """Corners (8, 3) of the box aligned with the principal axes of points (N, 3), and its longest edge."""
    centre = points.mean(0)
    _, _, axes = np.linalg.svd(points - centre, full_matrices=False)
    local = (points - centre) @ axes.T
    low, high = local.min(0), local.max(0)
    signs = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T
    return centre + (low + signs * (high - low)) @ axes, float((high - low).max())


def _unit(vector: Array, message: str) -> Array:
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise InputError(message)
    return vector / length
