"""What a body is made of before it gets a basis: its points, its kernels and their elasticity, its surface samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..asset.surface_distance import SurfaceDistance
from ..basis.reproducing_kernel import ReproducingKernel
from ..basis.rkpm import RkpmWeights, rkpm_weights
from ..ground.checks import Array, InputError, as_points
from ..ground.frames import Normalisation
from ..mechanics.tissue import GENERIC, Tissue
from .contact_samples import ContactSamples, contact_samples
from .elastic_modes import ModeSpace, mode_space
from .pins import AnyPin, pinned_points
from .quadrature import Cells, Quadrature, cell_quadrature
from .simulation_basis import SimulationBasis

MODE_POINTS = 10  # quadrature points of the kernels' elasticity per kernel


@dataclass(frozen=True)
class RestShape:
    """points (N, 3) m with volumes (N,) m^3 fill the body; cells: fewer points for its elastic energy.

    skinning: RKPM weights; modes: elasticity of their kernels; handles: a basis has four columns for each.
    """

    points: Array
    volumes: Array
    cells: Cells
    normalisation: Normalisation
    skinning: RkpmWeights
    modes: ModeSpace
    samples: ContactSamples
    handles: int

    @cached_property
    def surface(self) -> SurfaceDistance:
        """Signed distance to the surface at rest, m."""
        return SurfaceDistance(self.samples.vertices, self.samples.faces)

    def pinned(self, pins: tuple[AnyPin, ...]) -> tuple[Array, Array]:
        """Rest positions (k, 3) m that the pins hold and their springs (k,) N/m."""
        return pinned_points(pins, np.concatenate([self.points, self.samples.points]))

    def basis(self, held: Array, springs: Array) -> SimulationBasis:
        """About half of the 4 ``handles`` columns from skinning weights, the others from elastic modes.

        The modes are those of the body held at (k, 3) m by springs (k,) N/m. Rigid motions, of which a free body has
        six, are columns anyway.
        """
        skinned = self.skinning.coefficients.shape[1]
        columns = 4 * (self.handles - 1 - skinned)
        rigid = 0 if len(held) else 6
        components = self.modes.components(columns // 3 + rigid, self.normalisation.apply(held), springs)
        coefficients = np.concatenate([self.skinning.coefficients, components[:, 3 * rigid :]], axis=1)
        kernel = self.modes.kernel
        return SimulationBasis.orthonormal(self.normalisation, kernel, coefficients, skinned, self.points, self.volumes)


def rest_shape(
    points: ArrayLike,
    volumes: ArrayLike,
    vertices: ArrayLike,
    faces: NDArray[np.int64],
    *,
    tissue: Tissue = GENERIC,
    handles: int = 20,
    quadrature: int = 2000,
    nodes: int = 400,
    sample_spacing: float = 1e-3,
    seed: int = 0,
) -> RestShape:
    """Shape from points (N, 3) m with volumes (N,) m^3 inside a closed surface: vertices (Nv, 3) m, faces (Nf, 3).

    ``quadrature`` points of the elastic energy; ``nodes`` kernels; sample_spacing m: distance of the contact samples,
    at most half the radius of the thinnest tool.
    """
    points = as_points(points, "volume points", minimum=8)
    volumes = np.asarray(volumes, dtype=np.float64)
    if volumes.shape != (len(points),) or not (volumes > 0).all():
        raise InputError(f"volumes: expected {len(points)} numbers above 0, got shape {volumes.shape}")
    if handles < 4:
        raise InputError(f"handles: expected at least 4, got {handles}")
    centre = points.mean(0)
    normalisation = Normalisation(centre, float(np.sqrt(((points - centre) ** 2).sum(1).mean())))
    skinning = rkpm_weights(normalisation.apply(points), handles=handles // 2, nodes=nodes, seed=seed)
    fine = cell_quadrature(points, volumes, MODE_POINTS * nodes, seed).quadrature
    fine = Quadrature(normalisation.apply(fine.points), fine.weights)
    kernel = ReproducingKernel(skinning.nodes, skinning.radii)
    return RestShape(
        points=points,
        volumes=volumes,
        cells=cell_quadrature(points, volumes, quadrature, seed),
        normalisation=normalisation,
        skinning=skinning,
        modes=mode_space(kernel, fine, normalisation.length, tissue.youngs_pa, tissue.nu),
        samples=contact_samples(as_points(vertices, "vertices"), faces, sample_spacing),
        handles=handles,
    )
