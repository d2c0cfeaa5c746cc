"""Which of several starting poses is right: the one to which the organ bends most readily.

A rigid score cannot tell a wrong basin from a bent organ; after a short elastic solve right modes score 0.30 to 0.50,
wrong ones 0.63 and more (seven cases with known truth).
"""

from __future__ import annotations

from collections.abc import Callable, MutableMapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..align.landmark_prior import LandmarkPrior
from ..align.poses import Poses
from ..align.splat_view import SplatView
from ..ground.checks import Array
from ..ground.frames import Similarity, rotation_angle
from ..ground.progress import Progress, no_progress
from .elastic_registration import ElasticOptions, ElasticState, register_elastically
from .joint_scale import ScalePrior
from .matches import Deformed
from .reduced_organ import ReducedOrgan
from .visibility import visibility

ENERGY_UNIT = 0.05  # mean energy (Young's modulus 1) that counts as much as a cost of 1
SCORE_TAU = 0.08


@dataclass(frozen=True)
class ElasticScore:
    """Two-way robust cost of a bent organ plus its elastic energy and landmark penalty; lower is better."""

    splat: float
    camera: float
    energy: float
    landmarks: float

    @property
    def total(self) -> float:
        return self.splat + self.camera + self.energy + self.landmarks


@dataclass(frozen=True)
class RunnerUp:
    """The best other answer: its pose T_camera_normalised and score, and how far it is from the winner's bent organ:
    rotation in degrees and rms distance of the surface (normalised length)."""

    pose: Similarity
    score: ElasticScore
    degrees: float
    distance: float


@dataclass(frozen=True)
class Modes:
    """Candidate poses T_camera_normalised with their elastic scores, best first."""

    poses: Poses
    scores: tuple[ElasticScore, ...]
    states: tuple[ElasticState, ...]

    @property
    def best(self) -> Similarity:
        return self.poses.at(0)

    def runner_up(self, organ: ReducedOrgan, *, apart: float = 0.15) -> RunnerUp | None:
        """The best pose whose bent organ lies elsewhere, by rms more than ``apart`` (normalised), than the winner's."""
        winner = self._surface(organ, 0)
        for k in range(1, len(self.states)):
            difference = (self._surface(organ, k) - winner) / self.states[0].pose.scale
            distance = float(np.sqrt((difference**2).sum(1).mean()))
            if distance > apart:
                degrees = float(np.degrees(rotation_angle(self.poses.rotation[k], self.poses.rotation[0])))
                return RunnerUp(self.poses.at(k), self.scores[k], degrees, distance)
        return None

    def _surface(self, organ: ReducedOrgan, k: int) -> Array:
        return self.states[k].pose.apply(organ.points(self.states[k].z))


def choose_mode(
    organ: ReducedOrgan,
    view: SplatView,
    poses: Poses,
    *,
    landmarks: LandmarkPrior | None = None,
    scale_prior: Callable[[Similarity], ScalePrior] = lambda start: ScalePrior(),
    progress: Progress = no_progress,
    known: MutableMapping[bytes, ElasticState] | None = None,
) -> Modes:
    """Poses ranked by their fit after a short elastic solve; ``known``: solves done before by their pose, added to."""
    options = ElasticOptions.short()
    known = {} if known is None else known

    def fit(start: Similarity) -> tuple[ElasticState, ElasticScore]:
        state = known.get(start.key)
        if state is None:
            state, _ = register_elastically(organ, view, start, scale_prior=scale_prior, options=options)
            known[start.key] = state
        return state, elastic_score(organ, view, state, landmarks)

    fits = []
    with ThreadPoolExecutor(2) as pool:
        for result in pool.map(fit, [poses.at(k) for k in range(len(poses))]):
            fits.append(result)
            progress("rigid", len(fits) / len(poses))
    order = np.argsort([score.total for _, score in fits], kind="stable")
    return Modes(poses[order], tuple(fits[k][1] for k in order), tuple(fits[k][0] for k in order))


def elastic_score(
    organ: ReducedOrgan,
    view: SplatView,
    state: ElasticState,
    landmarks: LandmarkPrior | None = None,
    shape: Deformed | None = None,
) -> ElasticScore:
    """Score of a deformed organ; ``shape``: that of ``state``, where it is known already."""
    shape, pose, tau2 = shape or state.deformed(organ), state.pose, SCORE_TAU**2
    seen = visibility(shape, view, SCORE_TAU)
    tree = cKDTree(np.hstack([seen.points / pose.scale, 0.3 * pose.turn(shape.normals)]))
    surface = view.surface
    squared = tree.query(np.hstack([surface.samples / pose.scale, 0.3 * surface.sample_normals]))[0] ** 2
    unseen = seen.unknown & (seen.facing > 0.15)
    weight = np.where(seen.front | unseen, np.clip(seen.facing, 0, 1), 0) + seen.empty
    error = np.where(seen.front, seen.before, 0) ** 2 + np.where(seen.empty, seen.beside, 0) ** 2
    cost = np.where(seen.unknown, view.image.unseen_cost_at(seen.points), error / (error + tau2))
    return ElasticScore(
        splat=float((squared / (squared + tau2)).mean()),
        camera=float((weight * cost).sum() / max(weight.sum(), 1e-9)),
        energy=organ.elasticity.energy(state.z) / ENERGY_UNIT,
        landmarks=_landmark_cost(seen.points, pose.turn(shape.normals), pose.scale, view, landmarks),
    )


def _landmark_cost(
    points: Array, normals: Array, scale: float, view: SplatView, landmarks: LandmarkPrior | None
) -> float:
    if landmarks is None or not len(landmarks):
        return 0.0
    index = landmarks.sample_index
    return float(landmarks.cost_at(points[None, index], normals[None, index], np.array([scale]), view)[0])
