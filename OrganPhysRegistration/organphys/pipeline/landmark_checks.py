"""Landmarks against the organ: far ones are refused, near ones put on its surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError, as_points
from ..ground.notices import Notice
from ..points.point_sets import Landmarks, Organ

ON_SURFACE_MM = 10.0
TOO_FAR_MM = 50.0


def checked_landmarks(landmarks: Landmarks | None, organ: Organ) -> tuple[Array, tuple[Notice, ...]]:
    """Positions (L, 3) in RAS mm (L = 0 without landmarks); those 10 to 50 mm off the surface are moved onto it."""
    if landmarks is None:
        return np.zeros((0, 3)), ()
    positions = as_points(landmarks.positions, "landmarks").copy()
    distance, vertex = cKDTree(organ.vertices).query(positions)
    notices = []
    for k, far in enumerate(distance):
        name = _called(landmarks.names[k] if k < len(landmarks.names) else f"number {k + 1}")
        if far > TOO_FAR_MM:
            raise InputError(
                f"{name} lies {far:.0f} mm from the organ, {organ.name} (at most {TOO_FAR_MM:.0f} mm); "
                "check that the landmarks belong to this CT and organ and that RAS and LPS are not mixed up"
            )
        if far > ON_SURFACE_MM:
            positions[k] = organ.vertices[vertex[k]]
            text = f"{name} lay {far:.0f} mm off the organ and was put on its surface."
            notices.append(Notice("landmark_projected", text[0].upper() + text[1:]))
    return positions, tuple(notices)


def _called(name: str) -> str:
    return name if name.lower().startswith("landmark") else f"landmark {name}"
