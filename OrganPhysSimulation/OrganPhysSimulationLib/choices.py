"""The choices offered in the panel; ``label()`` is what a user reads."""

from __future__ import annotations

import enum

from slicer.i18n import tr as _


class TissueChoice(enum.Enum):
    """The organ's tissue; the value is the core's name of the preset, "" follows the organ's name."""

    Automatic = ""
    Generic = "generic"
    Liver = "liver"
    Spleen = "spleen"
    Kidney = "kidney"
    Pancreas = "pancreas"
    Prostate = "prostate"
    Gallbladder = "gallbladder"

    def label(self) -> str:
        return _("By the organ's name") if self is TissueChoice.Automatic else self.name


class InstrumentChoice(enum.Enum):
    """The instrument; the value is the core's name of it."""

    LargeNeedleDriver = "large_needle_driver"
    ProGrasp = "prograsp"
    Mega = "mega"

    def label(self) -> str:
        return {
            "LargeNeedleDriver": _("Large needle driver"),
            "ProGrasp": _("ProGrasp forceps"),
            "Mega": _("Mega needle driver"),
        }[self.name]


class GravityChoice(enum.Enum):
    """Where gravity pulls; the value is the direction in the CT, RAS, by how the patient lies, None: as drawn."""

    Supine = (0.0, -1.0, 0.0)
    LeftSide = (-1.0, 0.0, 0.0)
    RightSide = (1.0, 0.0, 0.0)
    Prone = (0.0, 1.0, 0.0)
    HeadUp = (0.0, 0.0, -1.0)
    Arrow = None

    def label(self) -> str:
        return {
            "Supine": _("Patient on the back"),
            "LeftSide": _("Patient on the left side"),
            "RightSide": _("Patient on the right side"),
            "Prone": _("Patient on the belly"),
            "HeadUp": _("Patient upright"),
            "Arrow": _("Along the arrow"),
        }[self.name]


class Colouring(enum.Enum):
    """What the surface's colours say; the value is the name of the point array, "" a plain colour."""

    Plain = ""
    Displacement = "displacement_mm"
    Stretch = "stretch_percent"

    def label(self) -> str:
        return {
            "Plain": _("None"),
            "Displacement": _("Displacement (mm)"),
            "Stretch": _("Surface stretch (%)"),
        }[self.name]
