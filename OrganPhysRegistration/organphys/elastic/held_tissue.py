"""Tissue that an instrument holds away from where the organ lies, and all that it draws along, is left out.

A robust weight leaves out what lies far off. The flanks of a fold that is drawn up lie between: near enough to count,
and all on one side. So a splat sample counts no more than what is worst around it. Only distances along the ray are
judged, for the surface beside the organ may belong to a neighbour; and those behind the organ only where it faces the
camera, since a grazing ray has no exact depth.
"""

from __future__ import annotations

import numpy as np

from ..align.splat_view import SplatView
from ..ground.checks import Array
from .matches import Deformed, Matches, geman_mcclure

FACING = 0.5  # cosine towards the camera from which depth behind the organ is judged
WORST = 0.85  # quantile that stands for the worst of a neighbourhood


def free_tissue(organ: Deformed, view: SplatView, matches: Matches, tau: float) -> Array:
    """Weights (M,) of the splat samples, small about a place where the splat lies more than ``tau`` (normalised) before
    or behind the organ; ``matches`` (M): every splat sample with an organ sample."""
    rays = view.surface.samples / np.linalg.norm(view.surface.samples, axis=1, keepdims=True) @ organ.start.rotation
    behind = np.einsum("ij,ij->i", organ.gamma * matches.targets - organ.points[matches.rows], rays)
    facing = -np.einsum("ij,ij->i", matches.normals, rays)
    distance = np.where((behind < 0) | (facing > FACING), np.abs(behind), 0.0)
    distance = np.median(distance[view.beside], axis=1)
    number = int(WORST * view.neighbourhoods.shape[1])
    worst = np.partition(distance[view.neighbourhoods], number, axis=1)[:, number]
    return geman_mcclure(np.maximum(worst, distance) ** 2, tau)
