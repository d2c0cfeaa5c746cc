"""One sub-problem of the elastic stage: fixed matches, unknown Z and scale.

x = X + Phi Z, targets gamma a: the data is exactly quadratic in q = (Z, gamma), and a uniform dilation of the scene
costs no elastic energy. Minimised: alpha ((1 - loads) E(Z) + loads L(Z)) + D(q) + prior(gamma), with E the elastic
energy and L the load prior.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from ..ground.checks import Array
from ..mechanics.lbfgs import minimise
from .load_prior import load_hessian
from .matches import Matches
from .reduced_organ import ReducedOrgan

PINNED = 1e6  # stiffness that holds gamma where the unit is known
PAIRS = tuple((a, b) for a in range(3) for b in range(a, 3))


@dataclass(frozen=True)
class ScalePrior:
    """Penalty weight * (gamma - gamma0)^2; weight 0: free, inf: gamma stays at gamma0."""

    gamma: float = 1.0
    weight: float = 0.0

    @classmethod
    def of(cls, expected_gamma: float, percent: float) -> ScalePrior:
        """Prior of a scale known to ``percent`` standard deviation (0: exact).

        Without a prior the registered scale is right to 2 % rms, and the objective rises by 0.018 (gamma - gamma*)^2
        about its optimum (both measured on the dev cases); a prior of 2 % weighs the same.
        """
        return cls(expected_gamma, np.inf if percent == 0 else 0.018 * (2 / percent) ** 2)


@dataclass(frozen=True)
class Quadratic:
    """1/2 q^T H q + b q + constant over q = (Z.ravel(), gamma)."""

    hessian: Array
    linear: Array

    def value_and_gradient(self, q: Array) -> tuple[float, Array]:
        product = self.hessian @ q
        return float(q @ (0.5 * product + self.linear)), product + self.linear


def data_quadratic(organ: ReducedOrgan, matches: Matches, points: Array, gamma: float, prior: ScalePrior) -> Quadratic:
    """The data term over (Z, gamma) plus the scale prior; ``points`` (S, 3): samples now, for the debiasing.

    Residuals in CT units shrink as the scene grows, which would reward a large scale: D / gamma^2, the data in scene
    units, has no such bias, and its gradient differs by -2 D / gamma, taken at the current state.
    """
    metric = matches.metric()
    metric_targets = (metric @ matches.targets[..., None])[..., 0]
    rows, summed, pulled = _by_sample(matches.rows, metric, metric_targets)
    phi, n = organ.phi[rows], organ.phi.shape[1]
    hessian, linear = np.zeros((3 * n + 1, 3 * n + 1)), np.zeros(3 * n + 1)
    blocks = hessian[:-1, :-1].reshape(n, 3, n, 3)
    for (a, b), block in zip(PAIRS, _products(phi, 2 * summed), strict=True):
        blocks[:, a, :, b] = block
        blocks[:, b, :, a] = block.T
    rest = organ.samples.points[rows]
    hessian[:-1, -1] = hessian[-1, :-1] = -2 * (phi.T @ pulled).ravel()
    hessian[-1, -1] = 2 * float((matches.targets * metric_targets).sum())
    linear[:-1] = 2 * (phi.T @ (summed @ rest[..., None])[..., 0]).ravel()
    residual = points[matches.rows] - gamma * matches.targets
    data = float((residual * (metric @ residual[..., None])[..., 0]).sum())
    linear[-1] = -2 * float((rest * pulled).sum()) - 2 * data / gamma
    stiffness = 2 * min(prior.weight, PINNED)
    hessian[-1, -1] += stiffness
    linear[-1] -= stiffness * prior.gamma
    return Quadratic(hessian, linear)


def _products(phi: Array, metric: Array) -> list[Array]:
    """Phi^T W Phi (n, n) with W each of the upper entries of metrics (U, 3, 3): in one matrix product."""
    count, n = phi.shape
    weighted = np.empty((count, len(PAIRS), n))
    for k, (a, b) in enumerate(PAIRS):
        np.multiply(metric[:, a, b, None], phi, out=weighted[:, k])
    products = (phi.T @ weighted.reshape(count, -1)).reshape(n, len(PAIRS), n)
    return [products[:, k] for k in range(len(PAIRS))]


def _by_sample(rows: NDArray[np.int64], metric: Array, pulls: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Organ samples (U,) with matches, their summed metrics (U, 3, 3) and pulls (U, 3): a sample stands in several
    matches, and its basis functions are the same in all of them."""
    order = np.argsort(rows, kind="stable")
    found, first = np.unique(rows[order], return_index=True)
    return found, np.add.reduceat(metric[order], first), np.add.reduceat(pulls[order], first)


def solve(
    organ: ReducedOrgan,
    data: Quadratic,
    alpha: float,
    loads: float,
    z: Array,
    gamma: float,
    *,
    steps: int,
    load: Array | None = None,
) -> tuple[Array, float, int]:
    """A few L-BFGS steps from (z, gamma), preconditioned with the Hessian at rest: Z, gamma and evaluations spent.

    ``alpha``: weight of the prior, of which the share ``loads`` is the load prior and the rest elastic energy;
    ``load``: Hessian of the load prior at z, where it is known already.
    """
    elastic = alpha * (1 - loads)
    if loads:
        data = replace(data, hessian=data.hessian.copy())
        data.hessian[:-1, :-1] += alpha * loads * (load_hessian(organ, z) if load is None else load)
    preconditioner = data.hessian.copy()
    preconditioner[:-1, :-1] += elastic * organ.rest_hessian
    factor = scipy.linalg.cho_factor(preconditioner, lower=True, check_finite=False)

    def objective(q: Array) -> tuple[float, Array]:
        energy, gradient = organ.elasticity.energy_and_gradient(q[:-1].reshape(-1, 3))
        value, slope = data.value_and_gradient(q)
        slope[:-1] += elastic * gradient.ravel()
        return elastic * energy + value, slope

    def precondition(gradient: Array) -> Array:
        solved: Array = scipy.linalg.cho_solve(factor, gradient, check_finite=False)
        return solved

    q, report = minimise(objective, np.append(z.ravel(), gamma), precondition=precondition, steps=steps)
    return q[:-1].reshape(-1, 3), float(q[-1]), report.evaluations
