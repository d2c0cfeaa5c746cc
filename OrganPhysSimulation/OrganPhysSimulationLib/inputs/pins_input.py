"""Pinned regions from the scene: points with a radius, and a box."""

from __future__ import annotations

from typing import Any

import numpy as np
import slicer

from organphys.ground.checks import Array, InputError
from organphys.simulation.pins import Pin
from OrganPhysRegistrationLib.inputs.matrices import apply_matrix, array_of, scale_of

STIFFNESS = 2e4  # N/m of a pinned region
MOST_BALLS = 4  # along each side of a box


def pins_of(points: Any, box: Any, radius_mm: float, T_world_sim: Array) -> tuple[Pin, ...]:
    """Pins in simulation metres; T_world_sim (4, 4): from simulation mm to world mm.

    Every placed point of ``points`` holds the tissue within radius_mm of it; ``box`` is filled with balls. Either may
    be None.
    """
    T_sim_world = np.linalg.inv(T_world_sim)
    length = 1e-3 * scale_of(T_sim_world)
    places = [apply_matrix(T_sim_world, place) * 1e-3 for place in placed_points(points)]
    pins = [Pin(tuple(place), radius_mm * length, STIFFNESS) for place in places]
    for centre, radius in _balls(box):
        pins.append(Pin(tuple(apply_matrix(T_sim_world, centre) * 1e-3), radius * length, STIFFNESS))
    return tuple(pins)


def holding(pins: tuple[Pin, ...], points: Array, *, of_box: int = 0) -> tuple[Pin, ...]:
    """The pins without those balls of the box (the last ``of_box``) that touch no tissue at points (N, 3) m.

    InputError: none of the box's balls holds anything.
    """
    kept = [pin for pin in pins[len(pins) - of_box :] if _near(pin, points)]
    if of_box and not kept:
        raise InputError("pin box: there is no tissue in it; move it onto the organ or clear it")
    return (*pins[: len(pins) - of_box], *kept)


def balls_in(box: Any) -> int:
    """How many pins a box gives."""
    return len(_balls(box))


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


def _near(pin: Pin, points: Array) -> bool:
    return bool((((points - np.array(pin.centre)) ** 2).sum(1) <= pin.radius**2).any())


def _balls(box: Any) -> list[tuple[Array, float]]:
    """Centres (3,) and radius, world mm, of balls that fill a box about evenly."""
    placed = placed_box(box)
    if placed is None:
        return []
    turn, size = placed
    counts = np.clip(np.ceil(size / size.min()), 1, MOST_BALLS).astype(int)
    cell = size / counts
    steps = [(np.arange(n) + 0.5) * c - s / 2 for n, c, s in zip(counts, cell, size, strict=True)]
    offsets = np.stack(np.meshgrid(*steps, indexing="ij"), -1).reshape(-1, 3)
    return [(apply_matrix(turn, offset), 0.5 * float(cell.max())) for offset in offsets]
