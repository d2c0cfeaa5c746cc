"""Instruments of the da Vinci patient side manipulator (PSM) as rows of parameters, and the arm's own table.

Modified Denavit-Hartenberg parameters and joint limits: share/kinematic/psm.json and share/tool/*.json of
sawIntuitiveResearchKit (Johns Hopkins University, dVRK), which quote the da Vinci Research Kit user guide, appendix C.
These files give no dimensions of the jaws. The large needle driver's hinge is 10.2 mm from its tip by the user guide;
lengths of the other jaws and all radii are nominal, rounded values for contact and display.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..ground.checks import Array, InputError, as_positive

JOINTS = ("yaw", "pitch", "insertion", "roll", "wrist_pitch", "wrist_yaw")
JOINT_UNITS = ("deg", "deg", "mm", "deg", "deg", "deg")  # as shown; joints are in rad and m
BEHIND_RCM = 0.4318 - 0.4162  # m: so far behind the remote centre is the wrist at insertion 0

# alpha rad, theta rad at joint 0, d m at joint 0; a is 0 except for the last row, where it is the wrist's length
DH_ALPHA = np.radians([90.0, -90.0, 90.0, 0.0, -90.0, -90.0])
DH_THETA = np.radians([90.0, -90.0, 0.0, 0.0, -90.0, -90.0])
DH_D = np.array([0.0, 0.0, -0.4318, 0.4162, 0.0, 0.0])
PRISMATIC = np.array([False, False, True, False, False, False])

# the tool frame (x along the hinge, z to the tip) in frame 6: the "tooltip-offset" of the tool files
R_6_TOOL = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class Instrument:
    """One instrument: lengths in m, angles in degrees.

    wrist_length: from the pitch axis to the hinge of the jaws (the table's a of the last row); jaw_length: hinge to
    tip; jaw_radius: of the capsule that stands for one jaw in contact; half_width: of the jaws along the hinge;
    shaft_radius; insertion: largest, from 0; jaw: range of the opening, below 0 the closed jaws press harder; the
    other ranges are symmetric; grip_force N: more than that pulls tissue out of the closed jaws.
    """

    name: str
    title: str
    wrist_length: float
    jaw_length: float
    jaw_radius: float = 0.002
    half_width: float = 0.0022
    shaft_radius: float = 0.0042
    yaw: float = 91.0
    pitch: float = 53.0
    insertion: float = 0.24
    roll: float = 260.0
    wrist_pitch: float = 80.0
    wrist_yaw: float = 80.0
    jaw: tuple[float, float] = (-20.0, 80.0)
    grip_force: float = 5.0

    def __post_init__(self) -> None:
        for name in ("wrist_length", "jaw_length", "jaw_radius", "half_width", "shaft_radius", "insertion"):
            as_positive(getattr(self, name), name)
        if not (0 < self.pitch < 90 and 0 < self.wrist_pitch < 90 and 180 <= self.roll < 540):
            raise InputError(
                f"{self.name}: expected pitch and wrist_pitch below 90 deg and roll of 180 to 540 deg, "
                f"got {self.pitch}, {self.wrist_pitch}, {self.roll}"
            )

    @cached_property
    def limits(self) -> Array:
        """Lowest and highest value (6, 2) of each joint, rad and m."""
        top = np.radians([self.yaw, self.pitch, 0.0, self.roll, self.wrist_pitch, self.wrist_yaw])
        limits = np.stack([-top, top], axis=1)
        limits[2] = 0.0, self.insertion
        limits.flags.writeable = False
        return limits

    @cached_property
    def ranges(self) -> Array:
        """Widths (6,) of the joints' ranges, rad and m."""
        return self.limits[:, 1] - self.limits[:, 0]

    @cached_property
    def home(self) -> Array:
        """Joints (6,) in the middle of their ranges: straight, half inserted."""
        middle: Array = self.limits.mean(1)
        middle.flags.writeable = False
        return middle


INSTRUMENTS: dict[str, Instrument] = {
    row.name: row
    for row in (
        Instrument("large_needle_driver", "Large needle driver (400006)", 0.0091, 0.0102),
        Instrument(
            "prograsp", "ProGrasp forceps (400093)", 0.0107, 0.020, jaw_radius=0.0022, half_width=0.0026, grip_force=7.0
        ),
        Instrument(
            "mega",
            "Mega needle driver (400194)",
            0.0112,
            0.0125,
            jaw_radius=0.0022,
            half_width=0.0025,
            roll=255.0,
            wrist_pitch=70.0,
            grip_force=6.0,
        ),
    )
}


def instrument_named(name: str) -> Instrument:
    """The row of that name; InputError names those there are."""
    if name not in INSTRUMENTS:
        raise InputError(f"instrument: expected one of {', '.join(INSTRUMENTS)}, got {name!r}")
    return INSTRUMENTS[name]
