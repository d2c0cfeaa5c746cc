"""Gravity as a line with two ends: the second is dragged to where down is."""

from __future__ import annotations

from typing import Any

import numpy as np

from organphys.ground.checks import Array
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix

from ..inputs.pins_input import placed_points
from ..roles import ensure, find

LENGTH_MM = 80.0


def write_gravity_line(T_world_sim: Array, centre: Array, direction: Array) -> Any:
    """The line from ``centre`` (3,) m along ``direction`` (3,) of the scene; it stands in the world."""
    node = ensure("gravity")
    down = direction / np.linalg.norm(direction)
    ends = [apply_matrix(T_world_sim, 1e3 * centre + length * down) for length in (0.0, LENGTH_MM)]
    old = placed_points(node)
    if len(old) == 2 and np.allclose(old, ends, atol=1e-4):
        return node
    modified = node.StartModify()
    node.RemoveAllControlPoints()
    for name, end in zip(("", "gravity 9.81 m/s²"), ends, strict=True):
        node.AddControlPointWorld(*end.tolist(), name)
    node.EndModify(modified)
    display = node.GetDisplayNode()
    display.SetSelectedColor(0.55, 0.85, 0.55)
    display.SetPropertiesLabelVisibility(False)
    display.SetPointLabelsVisibility(True)
    display.SetTextScale(2.5)
    return node


def drawn_direction(T_world_sim: Array) -> Array | None:
    """Direction (3,) of the line in the scene, None if it is not there or has no length."""
    ends = placed_points(find("gravity"))
    if len(ends) != 2 or np.allclose(*ends):
        return None
    turn = np.linalg.inv(T_world_sim)[:3, :3]
    direction: Array = turn @ (ends[1] - ends[0])
    return direction / np.linalg.norm(direction)
