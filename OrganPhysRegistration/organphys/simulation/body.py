"""One deformable body: basis, mass, elasticity, pins and surface, all at rest, in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..basis.reduced_elasticity import ReducedElasticity
from ..basis.rkpm import rkpm_weights
from ..ground.checks import Array, InputError, as_points
from ..ground.frames import Normalisation
from ..mechanics.tissue import GENERIC, Tissue
from .contact_surface import ContactSurface, sample_contact_surface
from .pins import Pin, pin_matrix
from .quadrature import Quadrature, cell_quadrature
from .simulation_basis import SimulationBasis
from .strain_energy import StrainEnergy


@dataclass(frozen=True)
class Body:
    """points (N, 3) m with volumes (N,) m^3 fill the body; quadrature: fewer points for the elastic energy.

    ``held`` (n, n): matrix of the springs of ``pins`` and of any others, N/m.
    """

    basis: SimulationBasis
    points: Array
    volumes: Array
    quadrature: Quadrature
    strain: StrainEnergy
    surface: ContactSurface
    tissue: Tissue
    held: Array
    pins: tuple[Pin, ...] = ()
    name: str = "organ"

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return self.tissue.density * float(self.volumes.sum())

    @cached_property
    def mean_phi(self) -> Array:
        """Volume mean (n,) of the basis: the centre of mass moves by mean_phi @ Z."""
        phi: Array = (self.volumes / self.volumes.sum()) @ self.basis.phi(self.points)
        return phi

    @cached_property
    def rest_stiffness(self) -> Array:
        """Hessian (3n, 3n) of the elastic energy at rest, N/m, in the order of Z.ravel()."""
        rows = self.strain.rows.reshape(3, len(self.quadrature.points), -1)
        material = self.tissue.material
        return ReducedElasticity(rows, self.quadrature.points, self.quadrature.weights, material).rest_hessian()

    def with_pins(self, *pins: Pin) -> Body:
        """This body held by these pins only (none: free)."""
        held = pin_matrix(self.basis, pins, np.concatenate([self.points, self.surface.points]))
        return replace(self, pins=pins, held=held)

    def with_tissue(self, tissue: Tissue) -> Body:
        """This body of another tissue."""
        return replace(self, tissue=tissue, strain=replace(self.strain, material=tissue.material))

    def centre_of_mass(self, z: Array) -> Array:
        """Centre of mass (3,), m, at Z (n, 3)."""
        centre: Array = (self.volumes / self.volumes.sum()) @ self.points + self.mean_phi @ z
        return centre


def build_body(
    points: ArrayLike,
    volumes: ArrayLike,
    vertices: ArrayLike,
    faces: NDArray[np.int64],
    *,
    tissue: Tissue = GENERIC,
    handles: int = 20,
    quadrature: int = 2000,
    nodes: int = 400,
    sample_spacing: float = 1.2e-3,
    seed: int = 0,
    name: str = "organ",
) -> Body:
    """Body with an own RKPM basis from points (N, 3) m with volumes (N,) m^3 inside a closed surface, m.

    vertices (Nv, 3) m, faces (Nf, 3); ``quadrature`` points of the elastic energy; ``nodes`` of the RKPM kernels;
    sample_spacing m: distance of the contact samples, at most half the radius of the thinnest tool.
    """
    points = as_points(points, "volume points", minimum=8)
    volumes = np.asarray(volumes, dtype=np.float64)
    if volumes.shape != (len(points),) or not (volumes > 0).all():
        raise InputError(f"volumes: expected {len(points)} numbers above 0, got shape {volumes.shape}")
    centre = points.mean(0)
    normalisation = Normalisation(centre, float(np.sqrt(((points - centre) ** 2).sum(1).mean())))
    weights = rkpm_weights(normalisation.apply(points), handles=handles, nodes=nodes, seed=seed)
    basis = SimulationBasis.orthonormal(weights, normalisation, points, volumes)
    cells = cell_quadrature(points, volumes, quadrature, seed)
    return Body(
        basis=basis,
        points=points,
        volumes=volumes,
        quadrature=cells,
        strain=strain_energy(basis, cells, tissue),
        surface=sample_contact_surface(basis, as_points(vertices, "vertices"), faces, sample_spacing),
        tissue=tissue,
        held=np.zeros((basis.size, basis.size)),
        name=name,
    )


def strain_energy(basis: SimulationBasis, cells: Quadrature, tissue: Tissue) -> StrainEnergy:
    """Elastic energy at the quadrature points of a body."""
    rows = np.ascontiguousarray(basis.phi_and_gradient(cells.points)[1].reshape(-1, basis.size))
    return StrainEnergy(rows, cells.weights, tissue.material)
