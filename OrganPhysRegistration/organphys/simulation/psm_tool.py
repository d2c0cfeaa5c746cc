"""Contact shapes of a PSM instrument: capsules for the jaws, the wrist and the shaft back to the trocar."""

from __future__ import annotations

import numpy as np

from .instruments import BEHIND_RCM, Instrument
from .tool_shapes import Capsule
from .tools import Jaws, Part, Tool

SHAFT_GAP = 0.3  # shaft radii: so far before the wrist's pitch axis the shaft's round end stops


def psm_tool(instrument: Instrument) -> Tool:
    """The tool of an instrument; place it with poses of ``Psm``, which say how the wrist is bent."""
    radius, wrist = instrument.jaw_radius, instrument.wrist_length
    parts = []
    for side in (-1, 1):  # as in ``gripper``: the closed jaws touch along the z axis
        offset = np.array([0.0, -side * radius, 0.0])
        parts.append(Part(Capsule(offset, offset + np.array([0, 0, instrument.jaw_length - radius]), radius), side))
    thickness = 0.75 * instrument.shaft_radius
    clevis = Capsule(np.zeros(3), np.array([0, 0, wrist]), thickness)
    inside = instrument.insertion - BEHIND_RCM
    start = instrument.shaft_radius * (1 + SHAFT_GAP)
    shaft = Capsule(np.array([0, 0, -start]), np.array([0, 0, -inside]), instrument.shaft_radius)
    jaws = Jaws(
        length=instrument.jaw_length,
        half_width=instrument.half_width,
        force_limit=instrument.grip_force,
    )
    return Tool(
        (*parts, Part(clevis, link="wrist"), Part(shaft, link="shaft")),
        jaws,
        instrument.name,
        wrist_length=wrist,
    )
