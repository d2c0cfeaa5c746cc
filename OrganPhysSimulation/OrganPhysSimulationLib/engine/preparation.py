"""What is computed once for an organ and once more for every change of its pins; seconds, so on another thread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from organphys.asset.registered_organ import RegisteredOrgan
from organphys.ground.checks import Array
from organphys.mechanics.tissue import Tissue
from organphys.points.gaussians import Gaussians
from organphys.simulation.blas_threads import one_blas_thread
from organphys.simulation.body import Body
from organphys.simulation.organ_body import metres_per_unit, organ_body
from organphys.simulation.pins import AnyPin
from organphys.simulation.quick_splat import QuickSplat, quick_splat

from .surface_motion import SurfaceMotion


@dataclass(frozen=True)
class Followers:
    """What moves with a body: its surface and, if there is a splat, the Gaussians bound to it."""

    surface: SurfaceMotion
    binding: QuickSplat | None

    @classmethod
    @one_blas_thread
    def of(cls, body: Body, gaussians: Gaussians | None, unit: float) -> Followers:
        """``unit``: metres per scene unit."""
        binding = None if gaussians is None else quick_splat(body, gaussians, unit)
        surface, z = SurfaceMotion.of(body), np.zeros((body.basis.size, 3))
        for first_time in (surface.normals, surface.stretch):  # their tables are made here, not in the first frame
            first_time(surface.rest + surface.displacement(body, z))
        if binding is not None:
            binding.frame(body, z)
        return cls(surface, binding)


@dataclass(frozen=True)
class Preparation:
    """An organ ready to move: ``body`` with its followers; ``unit``: metres per scene unit."""

    organ: RegisteredOrgan
    body: Body
    followers: Followers
    unit: float
    gaussians: Gaussians | None

    @property
    def centre(self) -> Array:
        """Middle (3,) of the surface at rest, m."""
        vertices = self.body.samples.vertices
        middle: Array = 0.5 * (vertices.min(0) + vertices.max(0))
        return middle

    @property
    def view_axis(self) -> Array:
        """Direction (3,) from the camera, the scene's origin, to the organ."""
        away: Array = self.centre / max(float(np.linalg.norm(self.centre)), 1e-9)
        return away


def prepare(
    organ: RegisteredOrgan,
    *,
    pins: tuple[AnyPin, ...],
    tissue: Tissue,
    gaussians: Gaussians | None,
    sample_spacing: float = 1e-3,
    handles: int = 20,
    quadrature: int = 2000,
) -> Preparation:
    """Body, surface and splat of an organ; sample_spacing: of the contact samples, m, half the radius of the jaws.

    InputError: a pin that holds nothing, a splat that is not near.
    """
    unit = metres_per_unit(organ)
    fineness = {"handles": handles, "quadrature": quadrature, "sample_spacing": sample_spacing}
    body = organ_body(organ, pins=pins, tissue=tissue, **fineness)
    return Preparation(organ, body, Followers.of(body, gaussians, unit), unit, gaussians)


def repinned_followers(prepared: Preparation, body: Body) -> Followers:
    """The followers of the same organ on the basis of other pins."""
    return Followers.of(body, prepared.gaussians, prepared.unit)
