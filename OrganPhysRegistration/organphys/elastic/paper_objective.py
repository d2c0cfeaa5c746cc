"""Objective of the paper's elastic ICP (equations 2 to 4), E(z) = alpha E_NH(z) + sum_i w_i |x_i(z) - u_i|^2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from ..basis.reduced_elasticity import ReducedElasticity
from ..ground.checks import Array
from ..ground.solve_report import SolveReport, Stop


@dataclass(frozen=True)
class PaperObjective:
    """The data term for fixed correspondences is quadratic in Z: with r = X - u, it is
    tr(Z^T A Z) + 2 <b, Z> + c, A = Phi^T W Phi (4H, 4H), b = Phi^T W r (4H, 3), c = sum_i w_i |r_i|^2.
    Written so, an evaluation costs the same for any number of surface points.
    """

    alpha: float
    elasticity: ReducedElasticity
    quadratic: Array
    linear: Array
    constant: float

    @classmethod
    def at(
        cls, alpha: float, elasticity: ReducedElasticity, phi: Array, surface: Array, matched: Array, weights: Array
    ) -> PaperObjective:
        """From Phi (S, 4H) and rest positions (S, 3), matched target points u (S, 3) and weights w (S,)."""
        weighted, rest = phi * weights[:, None], surface - matched
        constant = float(weights @ (rest**2).sum(1))
        return cls(alpha, elasticity, weighted.T @ phi, weighted.T @ rest, constant)

    def __call__(self, flat: Array) -> tuple[float, Array]:
        """E and its gradient (12H,) at Z.ravel()."""
        z = flat.reshape(-1, 3)
        energy, gradient = self.elasticity.energy_and_gradient(z)
        product = self.quadratic @ z
        data = float(((product + 2 * self.linear) * z).sum()) + self.constant
        return self.alpha * energy + data, (self.alpha * gradient + 2 * (product + self.linear)).ravel()

    def minimise(self, z: Array, *, steps: int, gradient_tolerance: float) -> tuple[Array, SolveReport]:
        """L-BFGS-B (Byrd, Lu, Nocedal, Zhu 1995) with the analytic gradient from Z (4H, 3)."""
        limits = {"maxiter": steps, "gtol": gradient_tolerance, "ftol": 0.0, "maxfun": 20 * steps}
        found = minimize(self, z.ravel(), jac=True, method="L-BFGS-B", options=limits)
        residual = float(np.abs(found.jac).max())
        stop = Stop.CONVERGED if found.status == 0 else Stop.STEP_LIMIT if found.status == 1 else Stop.STALLED
        return found.x.reshape(-1, 3), SolveReport(stop, int(found.nit), int(found.nfev), residual)


def correspondences(points: Array, tree: cKDTree, *, sigma: float, keep: float) -> tuple[Array, Array]:
    """Nearest target point (S, 3) of every surface point and its weight exp(-d^2 / (2 sigma^2)) (S,), equation 2.

    ``keep`` < 1 gives the farthest fraction 1 - keep of the pairs the weight zero.
    """
    distance, nearest = tree.query(points)
    weights = np.exp(-(distance**2) / (2 * sigma**2))
    if keep < 1:
        count = max(1, round(keep * len(distance)))
        weights[np.argpartition(distance, count - 1)[count:]] = 0.0
    return tree.data[nearest], weights
