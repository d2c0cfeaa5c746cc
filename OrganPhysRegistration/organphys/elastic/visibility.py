"""How the deformed organ stands in the reference image: what matches what was seen, and what must not be there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..align.splat_view import SplatView
from ..ground.checks import Array
from .matches import Deformed


@dataclass(frozen=True)
class Visibility:
    """Per organ sample (S,): camera-frame point (S, 3); cosine towards the camera; front: faces the camera on the mask
    and is not far behind what was seen; unknown: on a pixel nobody can judge; empty: on a pixel known to be empty;
    ``before``: how far it lies before the seen surface; ``beside``: how far off the mask (normalised lengths).
    """

    points: Array
    facing: Array
    front: NDArray[np.bool_]
    unknown: NDArray[np.bool_]
    empty: NDArray[np.bool_]
    before: Array
    beside: Array


def visibility(organ: Deformed, view: SplatView, tau: float) -> Visibility:
    """Visibility of all samples; ``tau`` (normalised) widens the depth gate to 1.5 tau behind the seen surface."""
    image, pose = view.image, organ.pose
    points, normals = pose.apply(organ.points), pose.turn(organ.normals)
    distance = np.linalg.norm(points, axis=1)
    depth = np.maximum(points[:, 2], 1e-3 * view.surface.radius)
    index = image.index(points[:, :2] / depth[:, None])
    inside = ((index >= 0) & (index < image.mask.shape)).all(1) & (points[:, 2] > 0)
    i, j = np.clip(index, 0, np.array(image.mask.shape) - 1).T
    unknown = image.unknown[i, j] | ~inside
    mask = image.mask[i, j] & inside
    facing = -np.einsum("ij,ij->i", normals, points) / distance
    before = (np.linalg.norm(view.surface.points[image.front[i, j]], axis=1) - distance) / pose.scale
    return Visibility(
        points=points,
        facing=facing,
        front=mask & ~unknown & (facing > 0.15) & (before > -1.5 * tau),
        unknown=unknown,
        empty=~mask & ~unknown,
        before=before,
        beside=image.gap[i, j] * depth / pose.scale,
    )
