"""The points of a markups list that count as landmarks, in the world."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer

from organphys.ground.checks import Array

USED = 2


def landmark_points(node: Any) -> tuple[Array, list[str]]:
    """Positions (L, 3) in world RAS mm and names of the first two placed points; L = 0 for None or an empty list."""
    positions, names = [], []
    for index in placed(node)[:USED]:
        positions.append(position_of(node, index))
        names.append(name_of(node, index, len(positions)))
    return np.array(positions, dtype=np.float64).reshape(-1, 3), names


def placed(node: Any) -> list[int]:
    """Indices of the points that have a position; the one under the mouse while placing has none."""
    if node is None:
        return []
    defined = slicer.vtkMRMLMarkupsNode.PositionDefined
    count = node.GetNumberOfControlPoints()
    return [index for index in range(count) if node.GetNthControlPointPositionStatus(index) == defined]


def name_of(node: Any, index: int, number: int) -> str:
    """Label of a point; one without a label is called by its ``number`` among the placed ones."""
    return node.GetNthControlPointLabel(index).strip() or f"Landmark {number}"


def position_of(node: Any, index: int) -> Array:
    """World position (3,), RAS mm, of a point."""
    position = [0.0, 0.0, 0.0]
    node.GetNthControlPointPositionWorld(index, position)
    return np.array(position)
