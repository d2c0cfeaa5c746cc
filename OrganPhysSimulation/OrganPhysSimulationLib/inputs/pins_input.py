"""Pinned regions from the scene: points with a radius, and a box."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer

from organphys.ground.checks import Array, InputError
from organphys.simulation.pins import AnyPin, BoxPin, Pin
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, array_of, scale_of


def pins_of(points: Any, box: Any, radius_mm: float, T_world_sim: Array) -> tuple[AnyPin, ...]:
    """Pins in simulation metres; T_world_sim (4, 4): from simulation mm to world mm.

    Every placed point of ``points`` holds the tissue within radius_mm of it, ``box`` what is in it. Either may be None.
    """
    T_sim_world = np.linalg.inv(T_world_sim)
    length = 1e-3 * scale_of(T_sim_world)
    places = [apply_matrix(T_sim_world, place) * 1e-3 for place in placed_points(points)]
    pins: list[AnyPin] = [Pin(tuple(place), radius_mm * length) for place in places]
    placed = placed_box(box)
    if placed is not None:
        T_world_box, sides = placed
        T_sim_box = T_sim_world @ T_world_box
        axes = T_sim_box[:3, :3] / np.linalg.norm(T_sim_box[:3, :3], axis=0)
        pins.append(BoxPin(tuple(1e-3 * T_sim_box[:3, 3]), tuple(map(tuple, axes.T)), tuple(length * sides)))
    return tuple(pins)


def holding(pins: tuple[AnyPin, ...], points: Array) -> tuple[AnyPin, ...]:
    """The pins. InputError: one of them is a box without tissue at points (N, 3) m."""
    if any(isinstance(pin, BoxPin) and pin.distances(points).min() > 0 for pin in pins):
        raise InputError("pin box: there is no tissue in it; move it onto the organ or clear it")
    return pins


def placed_points(node: Any) -> list[Array]:
    """World positions (3,), mm, of the defined control points of a markups node or None."""
    if node is None:
        return []
    defined = slicer.vtkMRMLMarkupsNode.PositionDefined
    rows = [k for k in range(node.GetNumberOfControlPoints()) if node.GetNthControlPointPositionStatus(k) == defined]
    return [np.array(node.GetNthControlPointPositionWorld(k)) for k in rows]


def placed_box(box: Any) -> tuple[Array, Array] | None:
    """Rigid matrix (4, 4) from a box's own axes to the world, and its sides (3,), mm; None where none is drawn."""
    if box is None or box.GetNumberOfDefinedControlPoints() == 0 or min(box.GetSize()) <= 0:
        return None
    matrix = array_of(box.GetObjectToWorldMatrix())
    stretch = np.linalg.norm(matrix[:3, :3], axis=0)
    matrix[:3, :3] /= stretch
    return matrix, stretch * np.array(box.GetSize())
