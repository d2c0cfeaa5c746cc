"""The reduced elastic organ of the OrganPhys paper (section 3.5) and the options of its elastic stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..basis.learned import learned_weights
from ..basis.reduced_basis import ReducedBasis
from ..basis.reduced_elasticity import ReducedElasticity
from ..basis.rkpm import rkpm_weights
from ..basis.skinning import SkinningWeights
from ..ground.checks import Array, InputError, as_points, as_positive, one_of
from ..ground.frames import Normalisation
from ..ground.progress import Progress, no_progress
from ..mechanics.neo_hookean import StableNeoHookean
from ..points.sampling import random_subset

LEVELS = {"conservative": (0.05,), "moderate": (0.05, 0.025), "aggressive": (0.05, 0.025, 0.005)}


@dataclass(frozen=True)
class PaperElasticOptions:
    """The paper's settings; a preset names the last of the alpha levels that are gone through.

    weights: "rkpm" or "learned"; youngs_pa and nu in the normalised CT frame; sigma and tolerance (largest move) in
    that frame; keep < 1 trims the worst correspondences (the paper's section 6.1 mentions it: 0.7); whiten: same
    deformation space, better conditioned coordinates, not the paper's. Figure 8: outer_steps=35, inner_steps=300.
    """

    stiffness: str = "moderate"
    weights: str = "rkpm"
    handles: int = 20
    youngs_pa: float = 2e4
    nu: float = 0.49
    sigma: float = 0.05
    quadrature: int = 2000
    outer_steps: int = 25
    inner_steps: int = 80
    gradient_tolerance: float = 1e-8
    tolerance: float = 1e-4
    keep: float = 1.0
    whiten: bool = False
    surface_points: int = 10_000
    seed: int = 0

    def __post_init__(self) -> None:
        one_of(self.stiffness, "stiffness", tuple(LEVELS))
        one_of(self.weights, "skinning weights", ("rkpm", "learned"))
        if not 0 < self.keep <= 1:
            raise InputError(f"keep: expected a fraction above 0 and up to 1, got {self.keep}")

    @property
    def alphas(self) -> tuple[float, ...]:
        """Stiffness weights from high to low, ending with the preset's own."""
        return LEVELS[self.stiffness]


@dataclass(frozen=True)
class PaperModel:
    """surface (S, 3) in the normalised frame, its Phi (S, 4H), and the elasticity of the same basis."""

    normalisation: Normalisation
    basis: ReducedBasis
    elasticity: ReducedElasticity
    surface: Array
    surface_phi: Array


def paper_model(
    boundary: Array,
    volume_points: Array,
    volume_ml: float,
    *,
    options: PaperElasticOptions | None = None,
    progress: Progress = no_progress,
) -> PaperModel:
    """Model from boundary voxel centres S (N, 3) and all voxel centres V (M, 3), RAS mm.

    S and V share one normalisation, centroid and largest absolute coordinate of S. Quadrature: ``quadrature`` points
    of V (seeded), each with the weight normalised organ volume / number of points.
    """
    options = options or PaperElasticOptions()
    boundary = as_points(boundary, "boundary points", minimum=8)
    volume_points = as_points(volume_points, "volume points", minimum=8)
    centre = boundary.mean(0)
    frame = Normalisation(centre, float(np.abs(boundary - centre).max()))
    inner = frame.apply(volume_points)
    progress("basis", 0.0)
    weights: SkinningWeights
    if options.weights == "rkpm":
        weights = rkpm_weights(inner, handles=options.handles, seed=options.seed)
    else:
        weights = learned_weights(inner, handles=options.handles, seed=options.seed, progress=progress)
    at = inner[random_subset(len(inner), options.quadrature, options.seed)]
    basis = ReducedBasis.whitened(weights, at) if options.whiten else ReducedBasis.plain(weights)
    volume = as_positive(volume_ml, "organ volume") * 1000.0 / frame.length**3
    material = StableNeoHookean.from_youngs(options.youngs_pa, options.nu)
    elasticity = ReducedElasticity.at(basis, at, material, volume=volume)
    surface = frame.apply(boundary[random_subset(len(boundary), options.surface_points, options.seed)])
    surface_phi = basis.phi(surface)
    progress("basis", 1.0)
    return PaperModel(frame, basis, elasticity, surface, surface_phi)
