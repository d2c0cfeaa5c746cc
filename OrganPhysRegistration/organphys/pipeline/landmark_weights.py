"""Which tissue the landmarks speak for: the Hann weights of the OrganPhys paper, for display."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..align.paper_coarse import projected_diameter
from ..align.paper_rigid import hann_radius, hann_weights
from ..ground.checks import Array, InputError, as_points, as_positive


def landmark_weights(
    points: ArrayLike, landmarks: ArrayLike, radius_mm: float | None = None, extent_mm: float | None = None
) -> tuple[Array, float]:
    """Weights (N,), 1 at a landmark and 0 from ``radius_mm`` on, of points (N, 3) and landmarks (L, 3), RAS mm; and
    the radius used.

    Without a radius (None or 0) it is the distance between the landmarks; with a single one half of ``extent_mm``,
    the organ's diameter as seen from the landmark (None: measured on the points).
    """
    points, landmarks = as_points(points, "points"), as_points(landmarks, "landmarks")
    if radius_mm:
        radius = as_positive(radius_mm, "landmark radius in mm")
    else:
        radius = hann_radius(landmarks, _extent(points, landmarks) if extent_mm is None else extent_mm)[0]
    return hann_weights(points, landmarks, radius), radius


def _extent(points: Array, landmarks: Array) -> float:
    """Diameter of the organ's outline seen along the line from the landmarks' midpoint to its centroid."""
    front = landmarks.mean(0) - points.mean(0)
    length = float(np.linalg.norm(front))
    if length < 1e-9:
        raise InputError("landmarks: their midpoint is the organ's centroid, pick points on the visible surface")
    return projected_diameter(points, front / length)[1]
