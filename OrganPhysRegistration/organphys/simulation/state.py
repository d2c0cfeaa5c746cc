"""The state of a simulation: frozen records, so that any past one can be kept, compared and returned to."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array


@dataclass(frozen=True)
class Touch:
    """Contacts at the end of the last step, one per pair of contact sample and tool part.

    sample, part (k,) int: indices; force (k,) N along normal (k, 3), which points from the tool to the organ.
    """

    sample: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    part: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    force: Array = field(default_factory=lambda: np.zeros(0))
    normal: Array = field(default_factory=lambda: np.zeros((0, 3)))


@dataclass(frozen=True)
class Grip:
    """Contact samples held between the jaws of one tool.

    sample (k,) int; anchor (k, 3) m in the tool's frame: where each is held; area m^2 that was caught, of which some
    may have slipped out since; closed: whether the jaws hold at all; passing (m,) int: samples that slipped out or were
    let go and are still within the tool, which does not push them until they have left it.
    """

    sample: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    anchor: Array = field(default_factory=lambda: np.zeros((0, 3)))
    area: float = 0.0
    closed: bool = False
    passing: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    allowed: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class BodyState:
    """Coordinates z and velocity (n, 3) in m and m/s, those one step before, ``dt_before`` s (0: there was none).

    reference (n, 3): where the stiffness of the solver's factor was taken; excess: conjugate gradient steps spent
    since then beyond a few per step. Both only decide how fast the next step is found.
    """

    z: Array
    velocity: Array
    z_before: Array
    velocity_before: Array
    reference: Array
    excess: int = 0
    dt_before: float = 0.0
    touch: Touch = field(default_factory=Touch)
    grips: tuple[Grip, ...] = ()

    @classmethod
    def at_rest(cls, size: int, tools: int = 0) -> BodyState:
        """Undeformed and unmoving, for a basis of ``size`` columns and so many tools."""
        zero = np.zeros((size, 3))
        return cls(zero, zero, zero, zero, zero, grips=(Grip(),) * tools)

    def projected(self, matrix: Array) -> BodyState:
        """This state with all coordinates (n, 3) replaced by ``matrix`` (k, n) times them."""
        return replace(
            self,
            z=matrix @ self.z,
            velocity=matrix @ self.velocity,
            z_before=matrix @ self.z_before,
            velocity_before=matrix @ self.velocity_before,
            reference=matrix @ self.reference,
        )


@dataclass(frozen=True)
class ToolPose:
    """Where a tool is: position (3,) m and rotation (3, 3) of its frame in the scene, jaw opening in degrees.

    shaft_rotation (3, 3): how the shaft of a tool with a wrist is turned, see ``tools.place``; None: as the tool.
    """

    position: Array
    rotation: Array = field(default_factory=lambda: np.eye(3))
    jaw_deg: float = 0.0
    shaft_rotation: Array | None = None


@dataclass(frozen=True)
class SceneState:
    """State of all bodies and the poses of all tools at ``time`` s."""

    bodies: tuple[BodyState, ...]
    tools: tuple[ToolPose, ...] = ()
    time: float = 0.0
