"""What the default method's coarse and rigid stages hand on, and what the user must be told of the pose."""

from __future__ import annotations

from dataclasses import dataclass

from ..align.start_search import Starts
from ..elastic.mode_choice import Modes
from ..elastic.reduced_organ import ReducedOrgan
from ..ground.frames import Similarity
from ..ground.notices import Notice
from .registration import AMBIGUOUS
from .stages import CoarseStage, RigidStage


@dataclass(frozen=True, kw_only=True)
class DefaultCoarse(CoarseStage):
    """The starts found, and ``free_start``, the best one of a search that does not know the unit."""

    starts: Starts
    free_start: Similarity


@dataclass(frozen=True, kw_only=True)
class DefaultRigid(RigidStage):
    """``pose``: T_camera_normalised, exactly as the elastic stage begins with it; ``score``: of its short fit, and
    ``runner_up``: that of the best pose clearly elsewhere, landmarks included."""

    pose: Similarity
    score: float | None = None
    runner_up: float | None = None


def mode_metrics(modes: Modes, organ: ReducedOrgan) -> dict[str, dict[str, float | str]]:
    """Score of the chosen pose, and of the best pose clearly elsewhere with its way from the chosen one."""
    metrics: dict[str, dict[str, float | str]] = {
        "pose_score": {"value": modes.scores[0].total, "unit": "1"},
        "poses_compared": {"value": float(len(modes.scores)), "unit": "1"},
    }
    runner_up = modes.runner_up(organ)
    if runner_up is not None:
        away_mm = runner_up.distance * organ.samples.normalisation.length
        metrics["runner_up_score"] = {"value": runner_up.score.total, "unit": "1"}
        metrics["runner_up_rotation"] = {"value": runner_up.degrees, "unit": "degrees"}
        metrics["runner_up_distance"] = {"value": away_mm, "unit": "mm"}
    return metrics


def mode_notices(modes: Modes, organ: ReducedOrgan, chosen_radius_mm: float | None) -> list[Notice]:
    """Whether another pose is as good; ``chosen_radius_mm``: of a single landmark whose radius nobody set."""
    notices, best, runner_up = [], modes.scores[0].total, modes.runner_up(organ)
    if runner_up is not None and runner_up.score.total < (1 + AMBIGUOUS) * best:
        away_mm = runner_up.distance * organ.samples.normalisation.length
        notices.append(
            Notice(
                "twist_ambiguous",
                f"Another pose fits almost as well (cost {runner_up.score.total:.2f} against {best:.2f}, no unit): it "
                f"is turned by {runner_up.degrees:.0f} degrees and its surface lies {away_mm:.0f} mm away (rms). "
                "Check the overlay from several sides, or give a landmark where the two differ.",
            )
        )
    if chosen_radius_mm is not None:
        notices.append(
            Notice(
                "single_landmark",
                f"One landmark only: OrganPhys chose its radius, {chosen_radius_mm:.0f} mm; the landmark counts as met "
                "within this distance of the seen surface.",
            )
        )
    return notices
