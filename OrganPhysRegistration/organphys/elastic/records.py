"""What the elastic stage found: one record per correspondence update, and the result."""

from __future__ import annotations

from dataclasses import dataclass

from ..basis.reduced_basis import ReducedBasis
from ..basis.reduced_covariance import ReducedCovariance
from ..ground.checks import Array
from ..ground.frames import Normalisation, Similarity
from ..ground.solve_report import SolveReport


@dataclass(frozen=True)
class ElasticStep:
    """State after one outer step (the curves of the paper's Figure 8).

    Distances in mm, to and from the surface points the solver works with (at most some thousand, so larger than to the
    whole surface); volume_drift_percent = 100 (mean det F - 1); largest_move_mm: farthest any surface point went in
    this step; energy: the objective minimised, in the method's own unit; evaluations: of it, within the step.
    """

    alpha: float
    trim30_splat_to_ct_mm: float
    mean_ct_to_splat_mm: float
    trim30_ct_to_splat_mm: float
    volume_drift_percent: float
    min_det_f: float
    largest_move_mm: float
    energy: float
    evaluations: int


@dataclass(frozen=True)
class ElasticResult:
    """Registered deformation: y = T_scene_ct.apply(normalisation.undo(X + Phi(X) z)), X = normalisation.apply(x_ct).

    z (4H, 3) in the coordinates of ``basis``; quadrature_points (Q, 3): where det F was watched, normalised frame;
    uncertainty: covariance of z and the scale, None where the method gives none.
    """

    T_scene_ct: Similarity
    normalisation: Normalisation
    basis: ReducedBasis
    z: Array
    quadrature_points: Array
    steps: tuple[ElasticStep, ...]
    report: SolveReport
    uncertainty: ReducedCovariance | None = None

    def map_points(self, points_ct: Array) -> Array:
        """Scene positions (N, 3) of CT points (N, 3) in RAS mm, inside the organ or near it."""
        x = self.normalisation.apply(points_ct)
        return self.T_scene_ct.apply(self.normalisation.undo(x + self.basis.phi(x) @ self.z))
