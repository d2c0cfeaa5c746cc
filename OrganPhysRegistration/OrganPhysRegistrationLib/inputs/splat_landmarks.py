"""Landmarks placed on the splat: the same tissue as the organ's landmarks, by label or in the same order."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from slicer.util import NodeModify

from organphys.ground.checks import Array, InputError
from organphys.points.point_sets import Landmarks

from .landmark_list import USED, landmark_points, name_of, placed, position_of
from .matrices import apply_matrix
from .splat_node import T_shown_scene, checked_splat
from .splat_scale import scene_to_world


def case_landmarks(landmarks_node: Any, splat_landmarks_node: Any, splat_node: Any) -> Landmarks | None:
    """The first two landmarks of the organ (world RAS mm) with their places on the splat (raw scene units), if placed.

    Either node may be None or empty. Labels are compared over all placed points of both lists; see paired_landmarks.
    InputError: neither labels nor counts agree, one list for both, or places without landmarks on the organ.
    """
    places = scene_points(splat_landmarks_node, splat_node)
    if places is None:
        positions, names = landmark_points(landmarks_node)
        return Landmarks(positions, tuple(names)) if len(positions) else None
    if splat_landmarks_node is landmarks_node:
        raise InputError("landmarks on the splat: this list holds the organ's landmarks; choose another list, or none")
    if not placed(landmarks_node):
        raise InputError(
            "landmarks on the splat: the organ has no landmarks; place the same points on the organ, or choose no list "
            "for the splat"
        )
    return _first_used(_paired(_all_points(landmarks_node), places))


def scene_points(node: Any, splat_node: Any) -> Landmarks | None:
    """All placed points of a list as they lie on the shown splat, raw scene units; None where there are none.

    Linear parent transforms of the splat and any of the list are honoured.
    """
    if not placed(node):
        return None
    checked_splat(splat_node)
    T_scene_world = np.linalg.inv(T_shown_scene(splat_node))
    world = _all_points(node)
    return replace(world, points_ct=apply_matrix(T_scene_world, world.points_ct))


def keep_on_splat(node: Any, splat_node: Any) -> None:
    """Put a point list under the splat's scene-to-world transform, where it stands now: it goes along from then on.

    Registration shows the splat at another scale, which points in the world would not follow. None is left alone.
    """
    if node is None:
        return
    mover = scene_to_world(checked_splat(splat_node))
    if _stands_under(node, mover):
        return
    points = [(index, position_of(node, index)) for index in placed(node)]
    with NodeModify(node):
        node.SetAndObserveTransformNodeID(mover.GetID())
        for index, point in points:
            node.SetNthControlPointPositionWorld(index, *point)


def same_places(first: Landmarks | None, second: Landmarks | None) -> bool:
    """Whether two cases' landmarks have the same places on the splat, up to rounding (1e-6 of the largest number)."""
    a, b = _places(first), _places(second)
    if a is None or b is None:
        return a is b
    return first.pairs == second.pairs and a.shape == b.shape and bool(np.abs(a - b).max() <= 1e-6 * np.abs(a).max())


def _paired(landmarks: Landmarks, places: Landmarks) -> Landmarks:
    from organphys.readers.landmark_pairs import paired_landmarks

    return paired_landmarks(landmarks, places)


def _first_used(landmarks: Landmarks) -> Landmarks:
    """Landmarks beyond the first two are not used, and neither are their places."""
    kept = [row for row, number in enumerate(landmarks.pairs) if number < USED]
    if not kept:
        raise InputError(
            f"landmarks on the splat: none of them belongs to the first {USED} landmarks of the organ; remove the "
            "landmarks that are not needed"
        )
    return Landmarks(
        landmarks.points_ct[:USED],
        landmarks.names[:USED],
        points_scene=landmarks.points_scene[kept],
        pairs=tuple(landmarks.pairs[row] for row in kept),
    )


def _all_points(node: Any) -> Landmarks:
    """All placed points of a list in the world, mm."""
    indices = placed(node)
    names = tuple(name_of(node, index, number) for number, index in enumerate(indices, start=1))
    return Landmarks(np.array([position_of(node, index) for index in indices]), names)


def _places(landmarks: Landmarks | None) -> Array | None:
    return None if landmarks is None else landmarks.points_scene


def _stands_under(node: Any, transform: Any) -> bool:
    parent = node.GetParentTransformNode()
    while parent is not None and parent is not transform:
        parent = parent.GetParentTransformNode()
    return parent is transform
