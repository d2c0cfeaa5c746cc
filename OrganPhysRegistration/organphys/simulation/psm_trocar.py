"""Where the trocar is: a sensible place where none is given, and the direction in which the arm enters."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..ground.checks import Array, InputError, as_points, as_vector, one_of
from .instruments import BEHIND_RCM, INSTRUMENTS, Instrument

ASIDE_DEG = 40.0  # between the line of sight and the instrument: arms stand beside the endoscope
CLEAR = 0.02  # m between the trocar and the organ
NEAREST = 0.005  # m between them where the place is given
SIDES = {"right": 1.0, "left": -1.0}


def default_trocar(
    points: ArrayLike,
    *,
    camera: ArrayLike = (0.0, 0.0, 0.0),
    right: ArrayLike = (1.0, 0.0, 0.0),
    side: str = "right",
    instrument: Instrument = INSTRUMENTS["large_needle_driver"],
) -> Array:
    """T_scene_rcm (4, 4) from which the straight instrument points at the middle of an organ.

    points (N, 3) m: the organ in the scene; camera (3,) m and its direction to the right (3,): the arm enters 40 deg
    to that ``side`` of the line of sight, on the camera's side of the organ. The middle lies at half of the insertion,
    or deeper where the trocar would come within 20 mm of a large organ. InputError: the organ is too large for that,
    or the camera stands in its middle.
    """
    points = as_points(points, "organ points")
    middle = points.mean(0)
    sight = as_vector(camera, "camera") - middle
    sideways = as_vector(right, "right")
    sideways = sideways - sight * (sideways @ sight) / max(float(sight @ sight), 1e-30)
    if np.linalg.norm(sight) < 1e-6 or np.linalg.norm(sideways) < 1e-6:
        raise InputError("camera: expected a place beside the organ's middle and a direction to its right")
    sight, sideways = sight / np.linalg.norm(sight), sideways / np.linalg.norm(sideways)
    angle = np.radians(ASIDE_DEG)
    out = np.cos(angle) * sight + SIDES[one_of(side, "side", tuple(SIDES))] * np.sin(angle) * sideways
    reach = instrument.wrist_length - BEHIND_RCM
    near_wall = float(((points - middle) @ out).max()) + CLEAR
    distance = max(instrument.insertion / 2 + reach, near_wall)
    if distance > instrument.insertion + reach:
        raise InputError(
            f"organ points: {1000 * near_wall:.0f} mm from the organ's middle to a trocar outside it is more than the "
            f"{instrument.title} reaches; give a trocar yourself"
        )
    return _entering(middle + distance * out, out, sideways)


def trocar_at(
    place: ArrayLike,
    points: ArrayLike,
    *,
    right: ArrayLike = (1.0, 0.0, 0.0),
    instrument: Instrument = INSTRUMENTS["large_needle_driver"],
) -> Array:
    """T_scene_rcm (4, 4) at ``place`` (3,) m, from which the straight instrument points at the middle of an organ.

    points (N, 3) m: the organ in the scene; ``right`` (3,): the camera's direction to the right. InputError: the place
    is too near to the organ or farther away than the instrument reaches.
    """
    points, place = as_points(points, "organ points"), as_vector(place, "trocar")
    gap = float(np.sqrt(((points - place) ** 2).sum(1)).min())
    if gap < NEAREST:
        raise InputError(f"trocar: {1000 * gap:.0f} mm from the organ; at least {1000 * NEAREST:.0f} mm are needed")
    away = place - points.mean(0)
    distance, most = float(np.linalg.norm(away)), instrument.insertion + instrument.wrist_length - BEHIND_RCM
    if distance > most:
        raise InputError(
            f"trocar: {1000 * distance:.0f} mm from the organ's middle; the {instrument.title} reaches "
            f"{1000 * most:.0f} mm, bring it nearer"
        )
    out, sideways = away / distance, as_vector(right, "right")
    if np.linalg.norm(np.cross(sideways, out)) < 1e-3 * np.linalg.norm(sideways):
        sideways = np.roll(sideways, 1)
    return _entering(place, out, sideways)


def _entering(place: Array, out: Array, sideways: Array) -> Array:
    """The frame (4, 4) at ``place`` whose z goes ``out`` of the body and whose x is next to ``sideways``."""
    x = sideways - (sideways @ out) * out
    x = x / np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(out, x), out], axis=1)
    pose[:3, 3] = place
    return pose
