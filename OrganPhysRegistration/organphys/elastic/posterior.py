"""How sure the registered deformation is: the Gaussian (Laplace) posterior of q = (Z, gamma) at the optimum.

Precision of q = N / (k s^2) J^T W J + K / T + scale: J are the derivatives of the residuals along the normal, for a
closest point says nothing about sliding; W their weights, summing to 1; s^2 and N the variance and the effective number
of the residuals; K the Hessian of the prior of the last level (loads and mean elastic energy at a Young's modulus of 1)
and T the cost by it that a degree of freedom of a real deformation holds on average, twice over (equipartition).
Translation and rotation lie in the constant handle, which K does not feel: only the data holds them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from ..align.splat_view import SplatView
from ..basis.reduced_covariance import ReducedCovariance
from ..ground.checks import Array
from ..points.sampling import random_subset
from .elastic_registration import ElasticOptions, ElasticState, find_matches
from .load_prior import load_hessian
from .reduced_organ import ReducedOrgan
from .residual_statistics import residual_statistics

FREE_SCALE = 0.5  # standard deviation of gamma that nothing but the data tells
EXACT_SCALE = 1e-4


@dataclass(frozen=True)
class PosteriorConstants:
    """Fitted on cases with known truth (Testing/benchmarks/calibration.py).

    data: k above, by how much the error variance of the data exceeds that of its residuals, which a fit makes small;
    temperature: T above; freedom: of the Student t that allows for s^2 and T being estimates.
    """

    data: float = 1.5
    temperature: float = 2.5e-4
    freedom: float = 6.0


@dataclass(frozen=True)
class PosteriorTerms:
    """Parts of the precision (12H + 1, 12H + 1): ``data`` = N / s^2 J^T W J; ``energy`` = K; ``scale``: of gamma."""

    data: Array
    energy: Array
    scale: float

    def covariance(self, constants: PosteriorConstants) -> ReducedCovariance:
        """The covariance of q with its Student t's degrees of freedom."""
        precision = self.data / constants.data
        precision[:-1, :-1] += self.energy / constants.temperature
        precision[-1, -1] += self.scale
        precision[np.diag_indices_from(precision)] += 1e-9 * np.trace(precision[:-1, :-1]) / len(precision)
        lower = scipy.linalg.cholesky(precision, lower=True, check_finite=False)
        inverse = scipy.linalg.solve_triangular(lower, np.eye(len(lower)), lower=True, check_finite=False)
        spread = constants.freedom / (constants.freedom - 2) if np.isfinite(constants.freedom) else 1.0
        return ReducedCovariance(np.sqrt(spread) * inverse.T, constants.freedom)


def posterior_terms(
    organ: ReducedOrgan,
    view: SplatView,
    state: ElasticState,
    *,
    scale_percent: float | None = None,
    options: ElasticOptions | None = None,
) -> PosteriorTerms | None:
    """Terms at an optimum with gamma = 1 (``ElasticState.without_rigid_part``); None where nothing matches.

    scale_percent: standard deviation of the stated unit (0: exact), None: no unit stated.
    """
    options = options or ElasticOptions()
    level = options.levels[-1]
    shape = state.deformed(organ)
    chosen = random_subset(len(organ.samples.points), options.organ_points, 0)
    matches = find_matches(organ, shape, view, chosen, level.tau, options.data)
    total = float(matches.weights.sum())
    if not total > 0:
        return None
    normals, targets = matches.normals, state.gamma * matches.targets
    residuals = np.einsum("ij,ij->i", normals, shape.points[matches.rows] - targets)
    found = residual_statistics(shape.points[matches.rows], residuals, matches.weights)
    slopes = np.empty((len(residuals), 3 * organ.basis.size + 1))
    slopes[:, :-1] = (organ.phi[matches.rows][:, :, None] * normals[:, None, :]).reshape(len(residuals), -1)
    slopes[:, -1] = -np.einsum("ij,ij->i", normals, targets)
    strength = found.independent / max(found.variance, 1e-12) / total
    percent = None if scale_percent is None else max(scale_percent / 100, EXACT_SCALE)
    return PosteriorTerms(
        data=strength * slopes.T @ (matches.weights[:, None] * slopes),
        energy=(1 - level.loads) * organ.elasticity.hessian(state.z, project=True)
        + level.loads * load_hessian(organ, state.z),
        scale=(percent or FREE_SCALE) ** -2,
    )
