"""How sure the default method's elastic result is: the covariance of its coordinates, and evidence for the verdict."""

from __future__ import annotations

from dataclasses import dataclass

from ..align.landmark_prior import LandmarkPrior
from ..align.splat_view import SplatView
from ..basis.reduced_covariance import ReducedCovariance
from ..elastic.elastic_registration import ElasticState
from ..elastic.posterior import PosteriorConstants, posterior_terms
from ..elastic.reduced_organ import ReducedOrgan
from ..ground.solve_report import SolveReport
from ..points.point_sets import SceneUnit
from .default_stages import DefaultRigid
from .fit_evidence import FitEvidence, fit_evidence
from .scale_checks import scale_percent


@dataclass(frozen=True)
class FitConfidence:
    """``uncertainty``: None where organ and splat do not meet at all, or where it was left out."""

    uncertainty: ReducedCovariance | None
    evidence: FitEvidence


def fit_confidence(
    organ: ReducedOrgan,
    view: SplatView,
    state: ElasticState,
    landmarks: LandmarkPrior,
    unit: SceneUnit | None,
    report: SolveReport,
    chosen: DefaultRigid | None,
    mirrored: float | None,
    *,
    covariance: bool = True,
) -> FitConfidence:
    """Of an elastic result without its rigid part; ``chosen``: the rigid stage it began with, None for another pose.
    Without ``covariance`` the uncertainty, which takes longest, is left out."""
    percent = None if unit is None else scale_percent(unit)
    terms = posterior_terms(organ, view, state, scale_percent=percent) if covariance else None
    evidence = fit_evidence(
        organ,
        view,
        state,
        landmarks=landmarks,
        last_move=report.residual,
        chosen=None if chosen is None else chosen.score,
        runner_up=None if chosen is None else chosen.runner_up,
        mirrored=mirrored,
    )
    return FitConfidence(None if terms is None else terms.covariance(PosteriorConstants()), evidence)
