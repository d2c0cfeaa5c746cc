"""One warm step of a sequence: the organ, from where it is expected, fitted to the next frame's splat."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..align.metrics import trimmed_mean
from ..align.splat_view import SplatView
from ..elastic.elastic_registration import ElasticLevel, ElasticOptions, ElasticState, register_elastically
from ..elastic.joint_scale import ScalePrior
from ..elastic.mode_choice import SCORE_TAU, elastic_score
from ..elastic.reduced_organ import ReducedOrgan
from ..elastic.temporal_prior import TemporalPrior
from ..elastic.visibility import visibility
from ..ground.checks import InputError
from ..ground.frames import Similarity

RECENT = 10  # frames that say what is usual


@dataclass(frozen=True)
class FollowOptions:
    """``damping``: strength of ``TemporalPrior``, no unit: 1 weighs a mean displacement since the frame before as much
    as the same distance between organ and splat; it holds back bending, not rigid motion. ``ahead``: share of its last
    motion by which the organ is expected to go on, which it is damped towards; 0: it stays. ``scale_percent``: standard
    deviation by which the scale may change from frame to frame, 0: it is that of the first. ``steps``: most outer steps
    a frame. Lost is the organ where its score (see ``elastic_score``) exceeds the usual one by ``worse`` times and
    ``by``, or where the share of its surface that is seen falls below ``seen`` of the usual one; then the whole search
    is run on that frame, unless ``restart`` is off."""

    damping: float = 0.01
    ahead: float = 0.5
    scale_percent: float = 0.0
    steps: int = 4
    worse: float = 1.4
    by: float = 0.1
    seen: float = 0.5
    restart: bool = True

    def __post_init__(self) -> None:
        for name in ("damping", "ahead", "scale_percent"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(
                    f"{name.replace('_', ' ')}: expected a number of at least 0, got {getattr(self, name)}"
                )
        if not 1 <= self.steps <= 200:
            raise InputError(f"steps: expected 1 to 200, got {self.steps}")


@dataclass(frozen=True)
class Fit:
    """A state with gamma = 1 in one frame, and how good it is: ``score`` no unit, ``distance_mm``: mean of the nearest
    70 % from the splat to the organ, ``seen_share`` of the organ's surface samples."""

    state: ElasticState
    score: float
    distance_mm: float
    seen_share: float


def follow_on(
    organ: ReducedOrgan, view: SplatView, expected: ElasticState, base: ElasticOptions, options: FollowOptions
) -> Fit:
    """The organ in the next frame, from where it is expected; ``base``: options of the first frame."""
    level = ElasticLevel(base.levels[-1].alpha, base.levels[-1].tau, options.steps)
    state, _ = register_elastically(
        organ,
        view,
        expected.start,
        scale_prior=lambda start: ScalePrior.of(1.0, options.scale_percent),
        options=replace(base, levels=(level,)),
        resume=expected,
        prior_on_z=_prior(organ, expected, options.damping),
    )
    return judged(organ, view, state.without_rigid_part(organ))


def judged(organ: ReducedOrgan, view: SplatView, state: ElasticState) -> Fit:
    """How well a state with gamma = 1 fits a frame."""
    shape, to_mm = state.deformed(organ), organ.samples.normalisation.length / state.pose.scale
    seen = visibility(shape, view, SCORE_TAU)
    distance = cKDTree(seen.points).query(view.surface.samples)[0] * to_mm
    score = elastic_score(organ, view, state, shape=shape).total
    return Fit(state, score, float(trimmed_mean(distance)), float(seen.front.mean()))


def is_lost(fit: Fit, good: Sequence[Fit], options: FollowOptions) -> str:
    """Why the organ is lost in a frame, given those before in which it was not; "" if it is not."""
    score = float(np.median([one.score for one in good[-RECENT:]]))
    share = float(np.median([one.seen_share for one in good[-RECENT:]]))
    if fit.score > options.worse * score + options.by:
        return f"the fit became worse at once (score {fit.score:.2f} after {score:.2f}, no unit)"
    if fit.seen_share < options.seen * share:
        return f"only {100 * fit.seen_share:.0f} % of the organ is seen after {100 * share:.0f} %"
    return ""


def _prior(organ: ReducedOrgan, expected: ElasticState, damping: float) -> TemporalPrior | None:
    return TemporalPrior.of(organ.basis, expected.z, damping) if damping else None


def state_of(z: np.ndarray, T_camera_normalised: Similarity) -> ElasticState:
    """The state of a registration's coordinates and pose."""
    return ElasticState(z, 1.0, T_camera_normalised)
