"""Tissue and gravity as the panel states them."""

from __future__ import annotations

from dataclasses import replace

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.checks import Array, InputError
from organphys.mechanics.tissue import PRESETS, Tissue, tissue_for
from organphys.simulation.options import SimulationOptions, gravity_along
from organphys.simulation.organ_body import scene_direction


def tissue_of(name: str, youngs_kpa: float, organ_name: str) -> Tissue:
    """Preset of that name ("": by the organ's), with Young's modulus ``youngs_kpa`` in place of its own if not 0."""
    if name and name not in PRESETS:
        raise InputError(f"tissue: expected one of {', '.join(PRESETS)}, got {name!r}")
    tissue = PRESETS[name] if name else tissue_for(organ_name)
    if not youngs_kpa:
        return tissue
    return replace(tissue, youngs_pa=1e3 * youngs_kpa, source=f"E stated by the user; else {tissue.source}")


def with_gravity(options: SimulationOptions, direction: Array | None) -> SimulationOptions:
    """The options with standard gravity along a direction (3,) of the scene, None: without gravity."""
    return replace(options, gravity=gravity_along(direction) if direction is not None else [0.0, 0.0, 0.0])


def gravity_by_patient(organ: RegisteredOrgan, direction_ras: tuple[float, float, float]) -> Array:
    """Direction (3,) in the scene of one in the CT."""
    return scene_direction(organ, direction_ras)
