"""The choices offered in the panel. Values are the names the core uses; ``label()`` is what a user reads."""

from __future__ import annotations

import enum

from slicer.i18n import tr as _


class CameraChoice(enum.Enum):
    """Where the endoscope stood."""

    SceneOrigin = "scene origin"
    FromView = "view"

    def label(self) -> str:
        return {"SceneOrigin": _("Scene origin"), "FromView": _("From 3D view")}[self.name]


class UnitChoice(enum.Enum):
    """Length of one scene unit; the value is millimetres, None where the user states it or nobody knows."""

    Unknown = "unknown"
    Millimetre = "mm"
    Centimetre = "cm"
    Metre = "m"
    Custom = "custom"

    def label(self) -> str:
        return {
            "Unknown": _("unknown"),
            "Millimetre": _("1 mm"),
            "Centimetre": _("1 cm"),
            "Metre": _("1 m"),
            "Custom": _("custom"),
        }[self.name]


class Method(enum.Enum):
    """Registration method; the value is RegisterOptions.method."""

    OrganPhys = "organphys"
    Paper = "paper"

    def label(self) -> str:
        return {"OrganPhys": _("OrganPhys"), "Paper": _("Paper (baseline)")}[self.name]


class Stiffness(enum.Enum):
    """How far the organ may be deformed; the value is RegisterOptions.stiffness."""

    Moderate = "moderate"
    Conservative = "conservative"
    Aggressive = "aggressive"
    Custom = "custom"

    def label(self) -> str:
        return {
            "Moderate": _("Moderate"),
            "Conservative": _("Conservative"),
            "Aggressive": _("Aggressive"),
            "Custom": _("By slider"),
        }[self.name]


class SkinningWeights(enum.Enum):
    """Basis of the paper method; the value is RegisterOptions.weights."""

    Rkpm = "rkpm"
    Learned = "learned"

    def label(self) -> str:
        return {"Rkpm": _("RKPM"), "Learned": _("Learned (needs PyTorch)")}[self.name]


class Stage(enum.Enum):
    """A stage whose result can be shown; the value is the core's name of it."""

    Before = "before"
    Coarse = "coarse"
    Rigid = "rigid"
    Elastic = "elastic"

    def label(self) -> str:
        return {"Before": _("Before"), "Coarse": _("Coarse"), "Rigid": _("Rigid"), "Elastic": _("Elastic")}[self.name]


class SurfaceColour(enum.Enum):
    """What colours the registered surface; the value is the name of its point array."""

    Distance = "distance_mm"
    Displacement = "displacement_mm"
    VolumeRatio = "det_F"
    Error68 = "error_68_mm"
    Error95 = "error_95_mm"

    def label(self) -> str:
        return {
            "Distance": _("Distance to the splat"),
            "Displacement": _("Displacement"),
            "VolumeRatio": _("Volume ratio (det F)"),
            "Error68": _("68 % error radius"),
            "Error95": _("95 % error radius"),
        }[self.name]


class OverlayIn(enum.Enum):
    """Where splat and results are shown together."""

    Endoscope = "endoscope"
    CT = "CT"

    def label(self) -> str:
        return {"Endoscope": _("Endoscope"), "CT": _("CT")}[self.name]
