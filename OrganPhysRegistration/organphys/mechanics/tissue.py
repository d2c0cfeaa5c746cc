"""Tissue presets: what the simulation of a registered organ is told about its material.

Registration itself does not depend on Young's modulus in the default method (its energy is taken per unit modulus);
it uses Poisson's ratio only. Values describe healthy adults and vary by half or more between people and studies.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..ground.checks import InputError, as_positive
from .neo_hookean import LogNeoHookean


@dataclass(frozen=True)
class Tissue:
    """Young's modulus ``youngs_pa`` (Pa, small strain), Poisson's ratio ``nu``, ``density`` (kg/m^3), their source."""

    name: str
    youngs_pa: float
    nu: float
    density: float
    source: str

    def __post_init__(self) -> None:
        as_positive(self.youngs_pa, "Young's modulus")
        as_positive(self.density, "density")
        if not 0 <= self.nu < 0.5:
            raise InputError(f"Poisson's ratio: expected at least 0 and below 0.5, got {self.nu}")

    @property
    def material(self) -> LogNeoHookean:
        """The Neo-Hookean material of the simulator, in Pa."""
        return LogNeoHookean.from_youngs(self.youngs_pa, self.nu)


_ARDA = "Arda et al., AJR 197:532-536, 2011 (shear-wave elastography, 127 healthy volunteers)"
_ICRU = "density: ICRU Report 46, 1992; nu: assumed, nearly incompressible"

GENERIC = Tissue("generic", 5000.0, 0.45, 1050.0, "assumed: middle of the soft abdominal organs below")

PRESETS: dict[str, Tissue] = {
    tissue.name: tissue
    for tissue in (
        GENERIC,
        Tissue(
            "liver",
            5500.0,
            0.45,
            1060.0,
            f"E: Roulot et al., J. Hepatol. 48:606-613, 2008 (transient elastography, 5.5 +/- 1.6 kPa); {_ICRU}",
        ),
        Tissue("spleen", 2900.0, 0.45, 1060.0, f"E: {_ARDA}, 2.9 +/- 1.8 kPa; {_ICRU}"),
        Tissue("kidney", 5000.0, 0.45, 1050.0, f"E: {_ARDA}, renal cortex 5.0 +/- 2.9 kPa; {_ICRU}"),
        Tissue("pancreas", 4800.0, 0.45, 1040.0, f"E: {_ARDA}, 4.8 +/- 3 kPa; {_ICRU}"),
        Tissue(
            "prostate",
            16000.0,
            0.45,
            1040.0,
            f"E: Zhang et al., Ultrasound Med. Biol. 34:1033-1042, 2008 (excised, normal 15.9 +/- 5.9 kPa); {_ICRU}",
        ),
        Tissue(
            "gallbladder",
            5000.0,
            0.45,
            1030.0,
            "E: assumed, a soft solid that stands for wall and bile together; the wall alone is far stiffer "
            f"(Karimi et al., J. Med. Eng. Technol. 2017); {_ICRU}",
        ),
    )
}


def tissue_for(organ: str) -> Tissue:
    """Preset whose name occurs in an organ's name ("Left Kidney" -> kidney), the generic one otherwise."""
    words = organ.lower().replace("gall bladder", "gallbladder")
    return next((tissue for name, tissue in PRESETS.items() if name in words), GENERIC)
