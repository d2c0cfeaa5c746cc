"""Force and torque of the tissue on each tool, and the low-pass filter for showing them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, as_positive
from .contact_terms import ContactTerms, ContactValue
from .state import ToolPose


class ToolForce(NamedTuple):
    """force (3,) N on the tool and torque (3,) N m about the origin of its frame, along the scene's axes."""

    force: Array
    torque: Array

    @classmethod
    def none(cls) -> ToolForce:
        return cls(np.zeros(3), np.zeros(3))

    def plus(self, other: ToolForce, share: float = 1.0) -> ToolForce:
        return ToolForce(self.force + share * other.force, self.torque + share * other.torque)


def tool_forces(
    terms: ContactTerms, value: ContactValue, z: Array, poses: tuple[ToolPose, ...], owner: NDArray[np.int64]
) -> list[ToolForce]:
    """What one body does to every tool; ``owner`` (P,): the tool of each part."""
    x = terms.positions(z)
    out = []
    for tool, pose in enumerate(poses):
        on_tool = np.zeros_like(x)
        for part in np.flatnonzero(owner == tool):
            on_tool -= value.press[part][:, None] * value.normals[part]
        mine = owner[terms.sticking.part] == tool
        np.add.at(on_tool, terms.sticking.row[mine], value.stick_pull[mine])
        for held, pull in zip(terms.held, value.grip_pull, strict=True):
            if held.tool == tool:
                on_tool[held.row] += pull
        out.append(ToolForce(on_tool.sum(0), np.cross(x - pose.position, on_tool).sum(0)))
    return out


def low_pass(shown: Array, measured: Array, dt: float, *, cutoff_hz: float = 5.0) -> Array:
    """The next shown value of a first-order low-pass filter (exact for a signal constant over the step dt, s)."""
    keep = float(np.exp(-2 * np.pi * as_positive(cutoff_hz, "cutoff") * as_positive(dt, "dt")))
    return keep * np.asarray(shown) + (1 - keep) * np.asarray(measured)
