"""The coarse pose of the default method, told in the terms of the paper's Figures 4 to 6."""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array
from ..ground.frames import Similarity, rotation_about
from ..points.surface_samples import SurfaceSamples
from .paper_coarse import oriented_box, projected_diameter
from .poses import Poses
from .records import CoarseView
from .splat_view import SplatView
from .two_way_fit import TwoWayFit

COST_NAME = "two-way robust cost, 0 to 2 (no unit)"


def pose_view(pose: Similarity, samples: SurfaceSamples, view: SplatView, *, twists: int = 12) -> CoarseView:
    """View of ``pose`` = T_camera_normalised: directions, extents, and the cost of the pose twisted about its axis."""
    centre = view.surface.samples.mean(0)
    to_viewer = -centre / np.linalg.norm(centre)
    front = pose.rotation.T @ to_viewer
    segment, diameter = projected_diameter(samples.points, front)
    corners, extent = oriented_box(view.surface.points)
    angles = 2 * np.pi * np.arange(twists) / twists
    T_scene_camera = view.T_camera_scene.inverse()
    return CoarseView(
        front_ct=front,
        viewer_scene=T_scene_camera.turn(to_viewer),
        hull_segment_ct=samples.normalisation.undo(segment),
        hull_diameter_mm=diameter * samples.normalisation.length,
        box_extent_scene=extent,
        box_corners_scene=T_scene_camera.apply(corners),
        twists_deg=np.degrees(angles),
        twist_costs=_twist_costs(pose, samples, view, to_viewer, angles),
        twist_cost_name=COST_NAME,
        chosen_twist_deg=0.0,
    )


def _twist_costs(pose: Similarity, samples: SurfaceSamples, view: SplatView, axis: Array, angles: Array) -> Array:
    """Cost (K,) of the pose turned about the viewing axis through the seen surface's centre."""
    pivot = view.surface.samples.mean(0)
    turned = []
    for angle in angles:
        rotation = rotation_about(axis, float(angle))
        turned.append(Similarity(1.0, rotation, pivot - rotation @ pivot) @ pose)
    fit = TwoWayFit(samples, samples.grid, view, count=600)
    splat, camera = fit.score(Poses.of(turned), 0.12)
    return splat + camera
