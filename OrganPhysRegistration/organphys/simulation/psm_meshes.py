"""Surfaces of a PSM instrument for display: shaft, wrist, two jaws, and a ring at the trocar. Metres.

The shapes are made from the instrument's row alone, each in the frame of its link, see ``tools``; they resemble the
instrument, they do not reproduce it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..ground.frames import rotation_about
from .instruments import BEHIND_RCM, Instrument
from .psm_jaws import KNUCKLE, jaw
from .psm_solids import Solid, circle, extruded, joined, rod, torus
from .state import ToolPose
from .tools import wrist_frames

OUTSIDE = 0.06  # m of shaft outside the trocar when fully inserted
MESH_COLOURS = {  # red, green, blue in 0..1
    "shaft": (0.16, 0.17, 0.19),
    "shaft_tip": (0.62, 0.64, 0.67),
    "wrist": (0.70, 0.72, 0.75),
    "jaw_left": (0.82, 0.83, 0.85),
    "jaw_right": (0.82, 0.83, 0.85),
    "trocar": (0.20, 0.62, 0.86),
}


class PlacedMesh(NamedTuple):
    """One closed surface: vertices (N, 3) m in the scene, triangles (M, 3) int, counter-clockwise from outside."""

    name: str
    vertices: Array
    triangles: NDArray[np.int64]


def psm_meshes(instrument: Instrument, pose: ToolPose, rcm: Array) -> list[PlacedMesh]:
    """The instrument at a pose, in the order of ``MESH_COLOURS``; rcm (3,) m: the trocar.

    The triangles of a name are always the same; only the vertices move, rigidly.
    """
    wrist, at, shaft = wrist_frames(pose, instrument.wrist_length)
    half, x = np.radians(max(pose.jaw_deg, 0.0)) / 2, np.array([1.0, 0.0, 0.0])  # closed jaws only press harder
    frames = {
        "shaft": (shaft, at),
        "shaft_tip": (shaft, at),
        "wrist": (wrist, at),
        "jaw_left": (pose.rotation @ rotation_about(x, -half), pose.position),
        "jaw_right": (pose.rotation @ rotation_about(x, half), pose.position),
        "trocar": (shaft, rcm),
    }
    meshes = link_meshes(instrument)
    return [
        PlacedMesh(name, meshes[name][0] @ rotation.T + origin, meshes[name][1])
        for name, (rotation, origin) in frames.items()
    ]


@lru_cache(maxsize=8)
def link_meshes(instrument: Instrument) -> dict[str, Solid]:
    """Vertices and triangles of every part in the frame of its link."""
    radius = instrument.shaft_radius
    back = instrument.insertion - BEHIND_RCM + OUTSIDE
    neck = 1.9 * radius  # the shaft's tube ends so far behind the pitch axis
    shaft = rod(
        "z", [(-back, 0.96 * radius), (-back + 4e-4, radius), (-neck - 4e-4, radius), (-neck, 0.94 * radius)], 32
    )
    ring = joined(torus(1.9 * radius, 0.28 * radius), torus(1.28 * radius, 0.12 * radius))
    return {
        "shaft": shaft,
        "shaft_tip": _shaft_tip(radius, neck),
        "wrist": _wrist(instrument),
        "jaw_left": jaw(instrument, -1),
        "jaw_right": jaw(instrument, 1),
        "trocar": ring,
    }


def _shaft_tip(radius: float, neck: float) -> Solid:
    """Metal end of the shaft: a collar and two ears that hold the pitch axis (y)."""
    collar = rod("z", [(-neck - 1e-4, 0.90 * radius), (-neck, 0.97 * radius), (-1.25 * radius, 0.97 * radius)], 32)
    outline = radius * np.concatenate([[[-1.4, -0.55]], _half_circle(0.62, -90.0), [[-1.4, 0.55]]])
    inner, outer = 0.5 * radius, 0.78 * radius
    ears = [extruded(outline, "y", low, low + outer - inner, 2e-4) for low in (-outer, inner)]
    pin = extruded(circle(0.22 * radius, 16), "y", -0.86 * radius, 0.86 * radius, 1e-4)
    return joined(collar, *ears, pin)


def _wrist(instrument: Instrument) -> Solid:
    """Link from the pitch axis (y, through the origin) to the hinge (x): a drum, a body and two ears."""
    radius, length = instrument.shaft_radius, instrument.wrist_length
    drum = extruded(circle(0.58 * radius), "y", -0.48 * radius, 0.48 * radius, 2e-4)
    lower, upper = 0.45 * radius, length - (KNUCKLE + 0.12) * radius
    square = _rounded(0.80 * radius, 0.48 * radius)
    body = extruded(square, "z", lower - 0.25 * radius, upper, 2e-4)
    base = upper - 3e-4
    tip = radius * _half_circle(0.54, 0.0) + np.array([0.0, length])
    outline = np.concatenate([[[0.58 * radius, base]], tip, [[-0.58 * radius, base]]])
    inner, outer = 0.52 * radius, 0.78 * radius
    ears = [extruded(outline, "x", low, low + outer - inner, 2e-4) for low in (-outer, inner)]
    pin = extruded(circle(0.22 * radius, 16), "x", -0.86 * radius, 0.86 * radius, 1e-4)
    return joined(drum, body, *ears, pin)


def _half_circle(radius: float, start_deg: float) -> Array:
    """Half a circle of points (n, 2), counter-clockwise."""
    angle = np.radians(start_deg) + np.linspace(0, np.pi, 13)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _rounded(a: float, b: float, power: float = 4.0) -> Array:
    """Outline (n, 2) of a rectangle of half sides a, b m with round corners: |x/a|^p + |y/b|^p = 1 (Lamé)."""
    angle = 2 * np.pi * np.arange(32) / 32
    c, s = np.cos(angle), np.sin(angle)
    ring: Array = np.stack([a * np.sign(c) * np.abs(c) ** (2 / power), b * np.sign(s) * np.abs(s) ** (2 / power)], 1)
    return ring
