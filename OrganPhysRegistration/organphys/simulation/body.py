"""One deformable body: a rest shape with its basis, elasticity, pins and surface, in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..basis.reduced_elasticity import ReducedElasticity
from ..ground.checks import Array
from ..mechanics.tissue import GENERIC, Tissue
from .contact_samples import ContactSamples
from .crushed_tissue import simulated_material
from .local_cells import RefinedCells, within
from .pins import AnyPin, spring_matrix
from .quadrature import Quadrature
from .rest_shape import RestShape
from .sample_basis import SampleBasis
from .simulation_basis import SimulationBasis
from .strain_energy import StrainEnergy

NOT_SMALL = 240_000  # numbers in the gradients' matrix, those of 1000 quadrature points and 80 columns


@dataclass(frozen=True)
class Body:
    """strain: elastic energy; sample_basis: basis without local columns at the contact samples; ``held`` (n, n):
    matrix N/m of the springs (k,) N/m at rest positions held_points (k, 3) m, which come from ``pins``, if from any;
    ``plain``: the same body without local functions, if it has some."""

    shape: RestShape
    basis: SimulationBasis
    strain: StrainEnergy
    sample_basis: SampleBasis
    tissue: Tissue
    held: Array
    held_points: Array
    springs: Array
    pins: tuple[AnyPin, ...] = ()
    name: str = "organ"
    plain: Body | None = None

    @property
    def samples(self) -> ContactSamples:
        """Contact samples at rest."""
        return self.shape.samples

    @property
    def dearness(self) -> float:
        """Cost of a Hessian product with local functions, in parts of one without (and of a body that is not small)."""
        if self.plain is None:
            return 1.0
        return max(1.0, self.strain.rows.size / max(self.plain.strain.rows.size, NOT_SMALL))

    @property
    def mass(self) -> float:
        """Mass, kg."""
        return self.tissue.density * float(self.shape.volumes.sum())

    @cached_property
    def mean_phi(self) -> Array:
        """Volume mean (n,) of the basis: the centre of mass moves by mean_phi @ Z.

        The columns are orthonormal, so these are also the coordinates of a displacement by 1 everywhere.
        """
        return self.basis.affine_coordinates(np.zeros((3, 3)), np.ones(3))[:, 0]

    @cached_property
    def sample_normals(self) -> Array:
        """Outward unit normals (S, 3) at rest at the contact samples: those of the nearest vertices."""
        surface = self.shape.surface
        normals: Array = surface.normals[cKDTree(surface.vertices).query(self.samples.points)[1]]
        return normals

    @cached_property
    def sample_cells(self) -> NDArray[np.int64]:
        """The quadrature point (S,) nearest to each contact sample."""
        cells: NDArray[np.int64] = cKDTree(self.strain.points).query(self.samples.points)[1]
        return cells

    @cached_property
    def vertex_phi(self) -> Array:
        """Basis (Nv, n) at the vertices of the surface."""
        return self.basis.phi(self.samples.vertices)

    @cached_property
    def patch_cells(self) -> NDArray[np.int64]:
        """The quadrature points (P, 4) nearest to the middle of every patch of contact samples."""
        middles = self.samples.points[self.samples.middle]
        cells: NDArray[np.int64] = cKDTree(self.strain.points).query(middles, k=min(4, len(self.strain.points)))[1]
        return cells.reshape(len(middles), -1)

    @cached_property
    def _refined(self) -> dict[float, RefinedCells]:
        return {}

    def refined(self, spacing: float) -> RefinedCells:
        """The cells with fine points ``spacing`` m apart and the basis without local columns at them."""
        if spacing not in self._refined:
            self._refined[spacing] = RefinedCells(self.shape, self.basis, spacing)
        return self._refined[spacing]

    @property
    def elasticity(self) -> ReducedElasticity:
        """The elastic energy with its whole Hessian."""
        rows = self.strain.rows.reshape(3, len(self.strain.weights), -1)
        return ReducedElasticity(rows, self.strain.points, self.strain.weights, self.strain.material)

    def vertices(self, z: Array) -> Array:
        """Surface vertices (Nv, 3), m, at Z (n, 3)."""
        return self.samples.vertices + self.vertex_phi @ z

    def sample_phi(self, samples: NDArray[np.int64]) -> Array:
        """Basis (k, n) at the contact samples (k,)."""
        base, local = self.sample_basis.rows(samples), self.basis.local
        if local is None:
            return base
        return np.concatenate([base, self._local_rows(samples) - base @ local.overlap], axis=1)

    def _local_rows(self, samples: NDArray[np.int64]) -> Array:
        """Local columns (k, m) at contact samples (k,), without what they take from the others."""
        return self._local_basis.rows(samples)

    @cached_property
    def _local_basis(self) -> SampleBasis:
        local = self.basis.local
        assert local is not None
        return SampleBasis(lambda x: local.functions.values(x) @ local.mixing, local.mixing.shape[1], self.samples)

    @cached_property
    def middle_phi(self) -> Array:
        """Basis (P, n) at the middle of every patch of contact samples."""
        middles, local = self.samples.points[self.samples.middle], self.basis.local
        if self.plain is None or local is None:
            return self.basis.phi(middles)
        base, near = self.plain.middle_phi, within(middles, local.functions.middle, local.functions.reach)
        columns = -base @ local.overlap
        columns[near] += local.functions.values(middles[near]) @ local.mixing
        return np.concatenate([base, columns], axis=1)

    def sample_positions(self, z: Array, samples: NDArray[np.int64]) -> Array:
        """Positions (k, 3), m, of the contact samples (k,) at Z (n, 3)."""
        local, base = self.basis.local, self.sample_basis.rows(samples)
        if local is None:
            return self.samples.points[samples] + base @ z
        n = base.shape[1]
        moved = base @ (z[:n] - local.overlap @ z[n:]) + self._local_rows(samples) @ z[n:]
        return self.samples.points[samples] + moved

    def centre_of_mass(self, z: Array) -> Array:
        """Centre of mass (3,), m, at Z (n, 3)."""
        volumes = self.shape.volumes
        centre: Array = (volumes / volumes.sum()) @ self.shape.points + self.mean_phi @ z
        return centre

    def with_tissue(self, tissue: Tissue) -> Body:
        """This body of another tissue, on the same basis: states stay valid."""
        plain = None if self.plain is None else self.plain.with_tissue(tissue)
        strain = replace(self.strain, material=simulated_material(tissue))
        return replace(self, tissue=tissue, strain=strain, plain=plain)

    def with_pins(self, *pins: AnyPin) -> Body:
        """This body held by these pins only, on a basis made for them: bring states over with ``transferred``."""
        return build_body(self.shape, pins=pins, tissue=self.tissue, name=self.name)


def build_body(
    shape: RestShape, *, pins: tuple[AnyPin, ...] = (), tissue: Tissue = GENERIC, name: str = "organ"
) -> Body:
    """The body of ``shape`` held by ``pins``."""
    return replace(held_body(shape, *shape.pinned(pins), tissue=tissue, name=name), pins=pins)


def held_body(
    shape: RestShape, points: Array, springs: Array, *, tissue: Tissue = GENERIC, name: str = "organ"
) -> Body:
    """The body of ``shape`` held at rest positions (k, 3) m by springs (k,) N/m, without pins to edit."""
    basis = shape.basis(points, springs)
    return Body(
        shape=shape,
        basis=basis,
        strain=strain_energy(basis, shape.cells.quadrature, tissue),
        sample_basis=SampleBasis(basis.phi, basis.size, shape.samples),
        tissue=tissue,
        held=spring_matrix(basis, points, springs),
        held_points=points,
        springs=springs,
        name=name,
    )


def strain_energy(basis: SimulationBasis, cells: Quadrature, tissue: Tissue) -> StrainEnergy:
    """Elastic energy at the quadrature points of a body."""
    rows = np.ascontiguousarray(basis.phi_and_gradient(cells.points)[1].reshape(-1, basis.size))
    return StrainEnergy(rows, cells.points, cells.weights, simulated_material(tissue))
