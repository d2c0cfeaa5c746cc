"""The jaws of an instrument as surfaces: a knuckle on the hinge and a tapered finger with teeth on its inner face."""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array
from .instruments import Instrument
from .psm_solids import Solid, circle, extruded, joined, lofted

TEETH = 11  # along a jaw
START = 0.8e-3  # m from the hinge to the root of the finger, within the knuckle
DEPTH = 0.25e-3  # m from crest to root
GAP = 0.03e-3  # m from the crests to the plane in which the closed jaws meet
KNUCKLE = 0.5  # of the shaft's radius


def jaw(instrument: Instrument, side: int) -> Solid:
    """Jaw -1 or +1 in its own frame: that of the tool, turned about x by side * opening / 2."""
    finger = lofted(_finger_rings(instrument))
    radius = KNUCKLE * instrument.shaft_radius
    knuckle = extruded(circle(radius), "x", 0.1e-3, 0.48 * instrument.shaft_radius, 0.15e-3)
    vertices, triangles = joined(finger, knuckle)
    half_turn = np.array([-side, -side, 1.0])  # jaw -1 is at y > 0; a half turn about z keeps triangles as they are
    return half_turn * vertices, triangles


def _finger_rings(instrument: Instrument) -> Array:
    """Rings (K, n, 3) of a finger at y > 0, from the hinge to the round tip."""
    length, start, pitch = instrument.jaw_length, START, 0.56 * instrument.jaw_length / TEETH
    toothed = 0.38 * length + pitch / 2 * np.arange(2 * TEETH + 1)
    before = np.linspace(start, toothed[0] - pitch / 2, 4)
    end = toothed[-1] + (length - toothed[-1]) * np.sin(np.linspace(0, np.pi / 2, 6)[1:])
    end[-1] = length
    along = np.concatenate([before, toothed, end])
    face = np.full(len(along), GAP + DEPTH / 2)
    face[len(before) : len(before) + len(toothed)] = GAP + DEPTH * (np.arange(len(toothed)) % 2)
    part = (along - start) / (length - start)
    taper = 1 - 0.4 * part**1.3
    round_tip = np.sqrt(np.clip(1 - np.maximum((along - toothed[-1]) / (length - toothed[-1]), 0.0) ** 2, 0.02, 1))
    neck = 0.47 * instrument.shaft_radius  # it fits between the ears of the wrist
    broad = np.minimum(instrument.half_width, neck + np.maximum(along - 0.7 * instrument.shaft_radius, 0.0))
    width = broad * taper * round_tip
    height = 1.25 * instrument.jaw_radius * taper * round_tip
    return np.stack([_section(*row) for row in zip(width, height, face, along, strict=True)])


def _section(width: float, height: float, face: float, along: float) -> Array:
    """One ring (n, 3): a flat inner face at y = ``face``, a rounded back up to y = ``height``."""
    shoulder = GAP + DEPTH + 0.25 * height  # not of this ring's tooth: the back stays smooth
    angle = np.linspace(0, np.pi, 11)
    back = np.stack([width * np.cos(angle), shoulder + (height - shoulder) * np.sin(angle)], axis=1)
    inner = np.stack([width * np.linspace(-0.9, 0.9, 3), np.full(3, face)], axis=1)
    ring = np.concatenate([back, inner])
    return np.column_stack([ring, np.full(len(ring), along)])
