"""One overall verdict on a registration: trust, check or do not trust, with its reasons in plain words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..ground.notices import Notice
from .fit_evidence import FitEvidence

TRUST, CHECK, REFUSE = "trust", "check", "do not trust"
LEVELS = (TRUST, CHECK, REFUSE)
HEADLINES = {
    TRUST: "Trust: nothing speaks against this registration.",
    CHECK: "Check: look at the overlay from several sides before you use this registration.",
    REFUSE: "Do not trust this registration.",
}
DOUBTFUL = frozenset({
    "little_seen", "implausible_volume", "implausible_scale", "hidden_tissue_moved", "twist_ambiguous",
    "scale_disagrees", "landmark_projected", "organ_in_scene_unsure",
})  # fmt: skip
"""Codes of notices that ask for a look at the result."""


@dataclass(frozen=True)
class VerdictLimits:
    """Beyond the first number of a pair a registration is to be checked, beyond the second not to be trusted.

    Set from good and deliberately broken runs (Testing/benchmarks/broken_runs.py), between the two.

    score, landmarks, last_move: as in FitEvidence, seen: below them; mirrored: ratio of the mirror image's score to the
    fit's, below them; hidden_error: median 95 % radius of the unseen surface over the organ's rms radius; least_det_f:
    below them; drift: mean change of volume, percent.
    """

    score: tuple[float, float] = (0.58, 0.7)
    landmarks: tuple[float, float] = (0.05, np.inf)
    seen: tuple[float, float] = (0.12, 0.04)
    last_move: tuple[float, float] = (0.02, 0.2)
    mirrored: tuple[float, float] = (1.12, 0.9)
    hidden_error: tuple[float, float] = (0.2, 0.5)
    least_det_f: tuple[float, float] = (0.3, 0.0)
    drift: tuple[float, float] = (12.0, 30.0)


@dataclass(frozen=True)
class Reason:
    """What speaks against the registration: ``code`` for programs, how much (CHECK or REFUSE), one plain sentence."""

    code: str
    level: str
    message: str


@dataclass(frozen=True)
class Verdict:
    """``level``: the worst of the reasons', TRUST without any."""

    level: str
    reasons: tuple[Reason, ...] = ()

    @classmethod
    def of(cls, reasons: Iterable[Reason]) -> Verdict:
        """The worst first."""
        found = sorted(reasons, key=lambda reason: -LEVELS.index(reason.level))
        return cls(found[0].level if found else TRUST, tuple(found))

    @property
    def headline(self) -> str:
        return HEADLINES[self.level]

    def as_dict(self) -> dict[str, Any]:
        """For files: level, headline and reasons."""
        return {"level": self.level, "headline": self.headline, "reasons": [vars(reason) for reason in self.reasons]}


def verdict_of(
    evidence: FitEvidence | None,
    metrics: Mapping[str, Mapping[str, float | str]],
    notices: Sequence[Notice],
    *,
    radius_mm: float,
    limits: VerdictLimits | None = None,
) -> Verdict:
    """Verdict on an elastic registration.

    evidence: None for methods that measure none; metrics {name: {"value", "unit"}} of the elastic stage; notices: all
    of the run; radius_mm: the organ's rms radius.
    """
    limits = limits or VerdictLimits()
    reasons = [Reason(notice.code, CHECK, notice.message) for notice in notices if notice.code in DOUBTFUL]
    if evidence is None:
        text = "This method does not measure how sure its result is."
        reasons.append(Reason("not_measured", CHECK, text))
    else:
        reasons += _of_the_fit(evidence, limits)
    number = {name: float(entry["value"]) for name, entry in metrics.items()}
    return Verdict.of([*reasons, *_of_the_shape(number, radius_mm, limits)])


def _of_the_fit(found: FitEvidence, limits: VerdictLimits) -> list[Reason]:
    """Score, landmarks, what was seen, convergence and handedness."""
    reasons = [
        _above("poor_fit", found.score, limits.score, "The organ does not fit what the splat shows: its cost is "
               f"{found.score:.2f} (no unit; right fits reach 0.28 to 0.50, wrong ones 0.7 and more)."),
        _above("landmarks_disagree", found.landmarks, limits.landmarks, "The landmarks do not lie on the seen side "
               "where the organ fits best: check that they are on the right organ and side."),
        _above("barely_seen", -found.seen, (-limits.seen[0], -limits.seen[1]), f"Only {100 * found.seen:.0f} % of the "
               "organ's surface lies where the splat shows it."),
        _above("not_converged", found.last_move, limits.last_move, "The elastic stage had not come to rest: its last "
               f"step still moved tissue by {100 * found.last_move:.0f} % of the organ's rms radius."),
    ]  # fmt: skip
    if found.mirrored is not None and found.mirrored < limits.score[1]:  # a mirror image that fits at all
        ratio = found.mirrored / max(found.score, 1e-9)
        text = (
            f"The organ's mirror image fits about as well or better (cost {found.mirrored:.2f} against "
            f"{found.score:.2f}): check that neither the splat nor the CT is mirrored (left and right, RAS and LPS)."
        )
        reasons.append(_above("handedness", -ratio, (-limits.mirrored[0], -limits.mirrored[1]), text))
    return [reason for reason in reasons if reason is not None]


def _of_the_shape(number: Mapping[str, float], radius_mm: float, limits: VerdictLimits) -> list[Reason]:
    """Folding, volume and how far the unseen side may be off."""
    reasons = []
    if "min_det_F" in number:
        least = number["min_det_F"]
        text = f"The tissue is squeezed to {100 * least:.0f} % of its volume somewhere (smallest det F {least:.2f})."
        reasons.append(_above("squeezed", -least, (-limits.least_det_f[0], -limits.least_det_f[1]), text))
    if "volume_drift" in number:
        drift = number["volume_drift"]
        text = f"The organ's volume changed by {drift:+.0f} %, more than soft tissue does."
        reasons.append(_above("volume_changed", abs(drift), limits.drift, text))
    if "error_95_hidden" in number:
        error = number["error_95_hidden"]
        text = f"The unseen side may be off by {error:.0f} mm (median 95 % radius; the organ's rms radius is "
        text += f"{radius_mm:.0f} mm)."
        reasons.append(_above("hidden_side_unsure", error / radius_mm, limits.hidden_error, text))
    return [reason for reason in reasons if reason is not None]


def _above(code: str, value: float, limits: tuple[float, float], message: str) -> Reason | None:
    """A reason where ``value`` exceeds the first limit; one not to trust beyond the second. NaN counts as beyond."""
    if value <= limits[0]:
        return None
    return Reason(code, CHECK if value <= limits[1] else REFUSE, message)
