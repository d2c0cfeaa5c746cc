"""What the fit itself tells about whether it is right: the numbers behind the verdict."""

from __future__ import annotations

from dataclasses import dataclass

from ..align.landmark_prior import LandmarkPrior
from ..align.splat_view import SplatView
from ..elastic.elastic_registration import ElasticState
from ..elastic.mode_choice import elastic_score
from ..elastic.reduced_organ import ReducedOrgan
from ..elastic.visibility import visibility

SEEN_TAU = 0.1


@dataclass(frozen=True)
class FitEvidence:
    """score: two-way robust cost plus elastic energy at the optimum, no unit (right fits of the known-truth cases 0.28
    to 0.50, wrong ones 0.70 and more); landmarks: penalty of landmarks the fit does not meet; runner_up: lowest score
    of a clearly different pose, None if there is none within reach; chosen: that of the pose taken; mirrored: of the
    organ's mirror image; seen: share of the organ's surface that lies where the splat shows it; last_move: of the last
    step, in rms radii of the organ.
    """

    score: float
    landmarks: float
    seen: float
    last_move: float
    chosen: float | None = None
    runner_up: float | None = None
    mirrored: float | None = None


def fit_evidence(
    organ: ReducedOrgan,
    view: SplatView,
    state: ElasticState,
    *,
    landmarks: LandmarkPrior,
    last_move: float,
    chosen: float | None,
    runner_up: float | None,
    mirrored: float | None,
) -> FitEvidence:
    """Evidence of an elastic fit that ended in ``state``."""
    score = elastic_score(organ, view, state, landmarks)
    seen = visibility(state.deformed(organ), view, SEEN_TAU)
    return FitEvidence(
        score=score.total - score.landmarks,
        landmarks=score.landmarks,
        seen=float(seen.front.mean()),
        last_move=last_move,
        chosen=chosen,
        runner_up=runner_up,
        mirrored=mirrored,
    )
