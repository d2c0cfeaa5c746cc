"""What a simulation starts from, gathered on the main thread, and what is computed from it beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.checks import Array, InputError
from organphys.mechanics.tissue import Tissue
from organphys.points.gaussians import Gaussians
from organphys.simulation.instruments import instrument_named
from organphys.simulation.options import SimulationOptions
from organphys.simulation.organ_body import metres_per_unit
from organphys.simulation.pins import AnyPin
from organphys.simulation.psm import Psm
from organphys.simulation.psm_trocar import default_trocar

from .engine.live_simulation import LiveSimulation
from .engine.preparation import prepare
from .inputs.organ_input import organ_of, splat_of_organ
from .inputs.pins_input import holding, pins_of
from .inputs.splat_input import gaussians_of_node
from .inputs.suggested_pins import some_vertices
from .inputs.tissue_input import tissue_of
from .outputs.frame_node import T_world_sim, write_frame

FINEST = 1e-3  # m between contact samples, unless the jaws are thinner than twice that


@dataclass(frozen=True)
class StartInputs:
    """Everything a simulation is made of, free of nodes."""

    organ: RegisteredOrgan
    gaussians: Gaussians | None
    pins: tuple[AnyPin, ...]
    tissue: Tissue
    psm: Psm
    options: SimulationOptions
    detail: bool = False
    handles: int = 20
    quadrature: int = 2000

    def built(self) -> LiveSimulation:
        """The simulation; seconds. No scene, no Qt: may run on another thread."""
        spacing = min(FINEST, 0.5 * self.psm.tool().radius)
        surface = self.organ.scene_vertices * metres_per_unit(self.organ)
        prepared = prepare(
            self.organ,
            pins=holding(self.pins, surface),
            tissue=self.tissue,
            gaussians=self.gaussians,
            sample_spacing=spacing,
            handles=self.handles,
            quadrature=self.quadrature,
        )
        return LiveSimulation(prepared, self.psm, options=self.options, detail=self.detail)


def gathered(
    organ_node: Any,
    splat: Any,
    *,
    pins: Any,
    box: Any,
    pin_radius_mm: float,
    tissue: str,
    youngs_kpa: float,
    gravity: Array | None,
    instrument: str,
    detail: bool,
    **fineness: int,
) -> StartInputs:
    """The inputs of a simulation from nodes; gravity (3,) m/s^2 along the scene's axes or None. InputError: what is
    wrong with them. The simulation's frame is made, so that pins have a place."""
    organ = organ_of(organ_node)
    registered = splat_of_organ(organ_node)
    if splat is not None and registered is not None and splat is not registered:
        raise InputError(f"splat: {organ_node.GetName()} was registered onto {registered.GetName()}; choose that one")
    matrix = T_world_sim(write_frame(splat, metres_per_unit(organ)))
    options = SimulationOptions()
    row = instrument_named(instrument)
    surface = some_vertices(organ) * metres_per_unit(organ)
    return StartInputs(
        organ=organ,
        gaussians=None if splat is None else gaussians_of_node(splat),
        pins=pins_of(pins, box, pin_radius_mm, matrix),
        tissue=tissue_of(tissue, youngs_kpa, organ.name),
        psm=Psm(row, default_trocar(surface, instrument=row)),
        options=options if gravity is None else replace(options, gravity=gravity),
        detail=detail,
        **fineness,
    )
