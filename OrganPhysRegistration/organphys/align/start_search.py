"""Global start: thousands of candidate poses refined coarse to fine by batched two-way Gauss-Newton.

Needs no landmark; landmarks narrow the views and break ties.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ..ground.checks import Array
from ..ground.progress import Progress, no_progress
from ..points.surface_samples import SurfaceSamples
from .landmark_prior import LandmarkPrior
from .poses import Poses
from .splat_view import SplatView
from .start_candidates import CandidateOptions, start_candidates
from .two_way_fit import TwoWayFit

IMPLAUSIBLE = 9.0  # added to the score of poses outside the plausible scale range


@dataclass(frozen=True)
class SearchStage:
    """``points`` a side, ``steps`` of Gauss-Newton at robust width ``tau``, ``batch`` poses at once.

    Then at most ``keep`` poses, ``apart_deg`` from each other, go on.
    """

    points: int
    steps: int
    tau: float
    damping: float
    batch: int
    keep: int | None = None
    apart_deg: float = 0.0


@dataclass(frozen=True)
class StartSearchOptions:
    """Stages from many rough to few exact poses."""

    candidates: CandidateOptions = field(default_factory=CandidateOptions)
    stages: tuple[SearchStage, ...] = (
        SearchStage(points=50, steps=3, tau=0.35, damping=0.05, batch=600, keep=400, apart_deg=8.0),
        SearchStage(points=150, steps=6, tau=0.2, damping=0.02, batch=200, keep=30, apart_deg=10.0),
        SearchStage(points=600, steps=14, tau=0.12, damping=0.003, batch=15),
        SearchStage(points=1500, steps=4, tau=0.1, damping=0.001, batch=15),
    )


@dataclass(frozen=True)
class Starts:
    """Poses T_camera_normalised, best first, and their scores (B,): splat side + camera side + landmarks."""

    poses: Poses
    scores: Array
    candidates: int

    def modes(self, *, most: int = 5, margin: float = 0.25, apart_deg: float = 8.0) -> Starts:
        """The distinct poses within ``margin`` of the best score."""
        index = self.poses.distinct(self.scores, most=most, angle_deg=apart_deg, log_scale=0.08)
        index = index[self.scores[index] <= self.scores[0] + margin]
        return Starts(self.poses[index], self.scores[index], self.candidates)


def search_start(
    samples: SurfaceSamples,
    view: SplatView,
    *,
    landmarks: LandmarkPrior | None = None,
    scale: float | None = None,
    scale_range: tuple[float, float] = (0.0, np.inf),
    options: StartSearchOptions | None = None,
    seed: int = 0,
    progress: Progress = no_progress,
) -> Starts:
    """Best poses of the organ in the view.

    ``scale``, scene units per normalised length, where it is known; else poses outside ``scale_range`` are left out.
    """
    options = options or StartSearchOptions()
    normals = None if landmarks is None else landmarks.normals
    found = start_candidates(
        samples, view, landmark_normals=normals, scale=scale, options=options.candidates, seed=seed
    )
    poses, scores = found.poses, np.zeros(0)
    low, high = max(scale_range[0], found.scale_range[0]), min(scale_range[1], found.scale_range[1])
    next_taus = [stage.tau for stage in options.stages[1:]] + [options.stages[-1].tau]
    with ThreadPoolExecutor(2) as pool:
        for number, (stage, next_tau) in enumerate(zip(options.stages, next_taus, strict=True)):
            progress("coarse", number / len(options.stages))
            fit = TwoWayFit(samples, samples.grid, view, count=stage.points, seed=seed)
            refine = partial(_refine, fit, stage, next_tau, scale is None)
            refined = list(pool.map(refine, [poses[k : k + stage.batch] for k in range(0, len(poses), stage.batch)]))
            poses, scores = Poses.join([p for p, _ in refined]), np.concatenate([s for _, s in refined])
            if landmarks is not None:
                scores = scores + landmarks.cost(poses, view)
            if scale is None:
                scores = scores + np.where((poses.scale < low) | (poses.scale > high), IMPLAUSIBLE, 0.0)
            if stage.keep is not None:
                index = poses.distinct(scores, most=stage.keep, angle_deg=stage.apart_deg)
                poses, scores = poses[index], scores[index]
    order = np.argsort(scores, kind="stable")
    progress("coarse", 1.0)
    return Starts(poses[order], scores[order], len(found.poses))


def _refine(fit: TwoWayFit, stage: SearchStage, next_tau: float, free_scale: bool, poses: Poses) -> tuple[Poses, Array]:
    """Poses after the stage's steps, and their scores at the width of the next stage."""
    for _ in range(stage.steps):
        poses = fit.step(poses, stage.tau, damping=stage.damping, free_scale=free_scale)
    splat, camera = fit.score(poses, next_tau)
    return poses, splat + camera
