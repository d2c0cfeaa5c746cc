"""Landmarks against organ and splat: far ones are refused, those near the organ put on its surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..ground.checks import Array, InputError, as_points
from ..ground.notices import Notice
from ..points.point_sets import Landmarks, Organ

ON_SURFACE_MM = 10.0
TOO_FAR_MM = 50.0
OFF_SPLAT = 0.75  # of the rms radius of the opaque Gaussians


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


def checked_partners(landmarks: Landmarks | None, centres: Array) -> Array:
    """Places in the scene (L, 3) of the landmarks, nan for those without, from opaque ``centres`` (N, 3).

    InputError: more or fewer places than landmarks they belong to, not finite, or far from the splat.
    """
    if landmarks is None or landmarks.points_scene is None:
        return np.full((0 if landmarks is None else len(landmarks.points_ct), 3), np.nan)
    places = as_points(landmarks.points_scene, "landmarks on the splat")
    count = len(landmarks.points_ct)
    pairs = range(count) if landmarks.pairs is None else landmarks.pairs
    if len(places) != len(pairs):
        raise InputError(
            f"landmarks on the splat: {len(places)} for {len(pairs)} landmarks in the CT; give one for each, in the "
            "same order, or name them alike"
        )
    if len(set(pairs)) != len(pairs) or not all(0 <= k < count for k in pairs):
        raise InputError(f"landmark pairs: expected different numbers from 0 to {count - 1}, got {tuple(pairs)}")
    radius = np.sqrt(((centres - centres.mean(0)) ** 2).sum(1).mean())
    distance = cKDTree(centres).query(places)[0]
    for k, far in zip(pairs, distance, strict=True):
        if far > OFF_SPLAT * radius:
            name = _called(landmarks.names[k] if k < len(landmarks.names) else f"number {k + 1}")
            raise InputError(
                f"{name} lies {far:.3g} scene units off the splat (its radius is {radius:.3g}); check that the "
                "landmarks on the splat are in its raw coordinates and that RAS and LPS are not mixed up"
            )
    found = np.full((count, 3), np.nan)
    found[list(pairs)] = places
    return found


def _called(name: str) -> str:
    return name if name.lower().startswith("landmark") else f"landmark {name}"
