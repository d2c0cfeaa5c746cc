"""The organ in its reduced basis: surface samples and quadrature points that move with Z (4H, 3)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg

from ..basis.reduced_basis import ReducedBasis
from ..basis.reduced_elasticity import ReducedElasticity
from ..basis.rkpm import rkpm_weights
from ..ground.checks import Array
from ..ground.frames import tangent_axes
from ..mechanics.neo_hookean import LogNeoHookean
from ..points.point_sets import Organ
from ..points.sampling import random_subset
from ..points.surface_samples import SurfaceSamples

USUAL = 12  # number of the mode whose stiffness is the unit of the load prior: the seventh that is not rigid


@dataclass(frozen=True)
class ReducedOrganOptions:
    """Handles include the constant one."""

    handles: int = 32
    nodes: int = 400
    basis_samples: int = 3000
    volume_points: int = 30000
    quadrature: int = 1500
    poissons_ratio: float = 0.45


@dataclass(frozen=True)
class ReducedOrgan:
    """phi (S, 4H) at the surface samples and its derivatives phi_tangent (2, S, 4H) along two unit ``tangents``
    (2, S, 3) whose cross product is the normal; phi_volume (Q, 4H) at the quadrature points of ``elasticity``, whose
    energy is the mean one of a Young's modulus of 1."""

    samples: SurfaceSamples
    basis: ReducedBasis
    elasticity: ReducedElasticity
    phi: Array
    tangents: Array
    phi_tangent: Array
    phi_volume: Array
    rest_hessian: Array

    @cached_property
    def load_unit(self) -> float:
        """Stiffness of a usual mode: twice its mean energy at an rms displacement of 1 (mass matrix I)."""
        number = min(USUAL, len(self.rest_hessian) - 1)
        stiffness = scipy.linalg.eigh(self.rest_hessian, eigvals_only=True, subset_by_index=[number, number])
        return float(stiffness[0])

    def points(self, z: Array) -> Array:
        """Deformed surface samples (S, 3), normalised CT frame."""
        return self.samples.points + self.phi @ z

    def displacement(self, other: ReducedOrgan, z: Array) -> Array:
        """Displacements (Q, 3) by this basis at the quadrature points of another reduction of the same organ."""
        moved: Array = self.basis.phi(other.elasticity.points) @ z
        return moved

    def coordinates(self, displacement: Array) -> Array:
        """Z (4H, 3) nearest to displacements (Q, 3) at the quadrature points, over which the basis is orthonormal."""
        fitted: Array = self.phi_volume.T @ displacement / len(displacement)
        return fitted

    def normals(self, z: Array) -> Array:
        """Unit normals (S, 3) of the deformed surface: the cross product of its moved tangents."""
        first, second = (tangent + slope @ z for tangent, slope in zip(self.tangents, self.phi_tangent, strict=True))
        normal = np.cross(first, second)
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def reduce_organ(
    organ: Organ, samples: SurfaceSamples, *, options: ReducedOrganOptions | None = None, seed: int = 0
) -> ReducedOrgan:
    """RKPM basis over the organ's volume, whitened, with a Neo-Hookean energy that is infinite where det F <= 0."""
    options = options or ReducedOrganOptions()
    rng = np.random.default_rng(seed)
    volume = samples.normalisation.apply(
        organ.volume_points[random_subset(len(organ.volume_points), options.volume_points, rng)]
    )
    weights = rkpm_weights(
        volume, handles=options.handles, nodes=options.nodes, samples=options.basis_samples, seed=seed
    )
    quadrature = volume[random_subset(len(volume), options.quadrature, rng)]
    basis = ReducedBasis.whitened(weights, quadrature)
    elasticity = ReducedElasticity.at(basis, quadrature, LogNeoHookean.from_youngs(1.0, options.poissons_ratio))
    phi, gradient = basis.phi_and_gradient(samples.points)
    tangents = np.stack(tangent_axes(samples.normals))
    return ReducedOrgan(
        samples=samples,
        basis=basis,
        elasticity=elasticity,
        phi=phi,
        tangents=tangents,
        phi_tangent=np.einsum("tsa,asn->tsn", tangents, gradient, optimize=True),
        phi_volume=basis.phi(quadrature),
        rest_hessian=elasticity.rest_hessian(),
    )
