"""Landmarks in the CT and the same tissue's places on the splat, from two files or texts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ..ground.checks import InputError
from ..points.point_sets import Landmarks
from .landmarks_file import read_landmarks


def read_landmark_pairs(on_organ: str | Path, on_splat: str | Path) -> Landmarks:
    """Landmarks of the CT (RAS mm) with their places on the splat; both as ``read_landmarks`` takes them.

    The splat's numbers are raw scene coordinates: RAS numbers as they are, LPS with x and y turned back. Points are
    matched by their labels where every label of the splat is one of the CT's, else by their order.
    InputError: unreadable, or neither labels nor counts agree.
    """
    return paired_landmarks(read_landmarks(on_organ), read_landmarks(on_splat))


def paired_landmarks(landmarks: Landmarks, places: Landmarks) -> Landmarks:
    """``landmarks`` of the CT with ``places``, points on the splat (raw scene units), matched by label or by order."""
    names, labels = landmarks.names, places.names
    if labels and set(labels) <= set(names) and len(set(labels)) == len(labels) and len(set(names)) == len(names):
        place = {name: k for k, name in enumerate(names)}
        pairs = tuple(place[label] for label in labels)
    elif len(places.points_ct) == len(landmarks.points_ct):
        pairs = tuple(range(len(landmarks.points_ct)))
    else:
        raise InputError(
            f"landmarks on the splat: {len(places.points_ct)} for {len(landmarks.points_ct)} landmarks in the CT, and "
            "their labels do not match; give each pair the same label, or as many points in the same order"
        )
    return replace(landmarks, points_scene=places.points_ct, pairs=pairs)
