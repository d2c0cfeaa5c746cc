"""Region-weighted trimmed rigid ICP of the OrganPhys paper (section 3.4)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from ..ground.checks import Array, as_points
from ..ground.frames import Similarity, fit_similarity, rotation_about
from ..ground.progress import Progress, no_progress
from ..ground.solve_report import SolveReport, Stop
from ..points.sampling import random_subset
from .metrics import trimmed_mean
from .records import CoarseView


@dataclass(frozen=True)
class PaperRigidOptions:
    """starts: twists about the viewing axis; keep: fraction of the pairs kept (the closest ones).

    tolerance: the ICP has converged when no point moves farther, as a fraction of the splat's box (the paper
    names no stopping rule; neither for ``iterations``, the most per start). radius_mm: r of the Hann weights where the
    user sets it.
    """

    starts: int = 6
    keep: float = 0.5
    iterations: int = 100
    tolerance: float = 1e-4
    surface_points: int = 10_000
    seed: int = 0
    radius_mm: float | None = None


@dataclass(frozen=True)
class PaperRigidResult:
    """T_scene_ct; trim30 mean distance CT to splat of every start (K,), mm at the registered scale; why it stopped.

    radius_mm: r of the Hann weights; single_landmark: r was chosen by OrganPhys (half of the projected diameter).
    """

    T_scene_ct: Similarity
    start_twists_deg: Array
    start_costs_mm: Array
    radius_mm: float
    single_landmark: bool
    report: SolveReport


def paper_rigid(
    surface: Array,
    target: Array,
    landmarks: Array,
    *,
    coarse: Similarity,
    view: CoarseView,
    options: PaperRigidOptions | None = None,
    progress: Progress = no_progress,
) -> PaperRigidResult:
    """Rigid refinement of ``coarse`` (T_scene_ct): CT boundary points (S, 3) and landmarks (L, 3) in mm, scale kept."""
    options = options or PaperRigidOptions()
    surface, target = as_points(surface, "CT surface points"), as_points(target, "splat points", minimum=4)
    landmarks = as_points(landmarks, "landmarks")
    surface = surface[random_subset(len(surface), options.surface_points, options.seed)]
    automatic = hann_radius(landmarks, view.hull_diameter_mm)
    radius, single = automatic if options.radius_mm is None else (options.radius_mm, False)
    weights, tree = hann_weights(surface, landmarks, radius), cKDTree(target)
    pivot = coarse.apply(surface.mean(0))
    twists = 2 * np.pi * np.arange(options.starts) / options.starts
    costs, outcomes = np.empty(len(twists)), []
    for k, angle in enumerate(twists):
        rotation = rotation_about(view.viewer_scene, angle)
        start = Similarity(1.0, rotation, pivot - rotation @ pivot) @ coarse

        def step(fraction: float, done: int = k) -> None:
            progress("rigid", (done + fraction) / len(twists))

        outcomes.append(_icp(surface, weights, tree, start, view.box_extent_scene * options.tolerance, options, step))
        costs[k] = trimmed_mean(tree.query(outcomes[-1][0].apply(surface))[0]) / coarse.scale
    progress("rigid", 1.0)
    best = int(costs.argmin())
    return PaperRigidResult(outcomes[best][0], np.degrees(twists), costs, radius, single, outcomes[best][1])


def hann_radius(landmarks: Array, hull_diameter_mm: float) -> tuple[float, bool]:
    """r in mm and whether OrganPhys chose it: the (largest) distance between landmarks, or half of the diameter."""
    between = float(pdist(landmarks).max()) if len(landmarks) > 1 else 0.0
    return (between, False) if between > 1e-6 else (0.5 * hull_diameter_mm, True)


def hann_weights(points: Array, landmarks: Array, radius: float) -> Array:
    """w (N,) = 0.5 (1 + cos(pi d / r)) for d < r, else 0; d: distance of points (N, 3) to the nearest landmark."""
    distance = cKDTree(landmarks).query(points)[0]
    return np.where(distance < radius, 0.5 * (1 + np.cos(np.pi * np.minimum(distance / radius, 1.0))), 0.0)


def _icp(
    surface: Array,
    weights: Array,
    tree: cKDTree,
    start: Similarity,
    tolerance: float,
    options: PaperRigidOptions,
    step: Callable[[float], None],
) -> tuple[Similarity, SolveReport]:
    """Weighted trimmed ICP from one start; ``tolerance`` in scene units."""
    pose, moved = start, start.apply(surface)
    keep, largest, reach = max(3, round(options.keep * len(surface))), float("inf"), float("inf")
    for iteration in range(options.iterations):
        step(iteration / options.iterations)
        # the pairs kept cannot lie farther than the last ones did plus the last move: the rest need not be searched
        distance, nearest = tree.query(moved, distance_upper_bound=reach)
        kept = np.argpartition(distance, keep - 1)[:keep]
        kept = kept[weights[kept] > 0]
        if len(kept) < 3:
            return pose, SolveReport(Stop.NO_DATA, iteration, iteration + 1, largest)
        correction = fit_similarity(moved[kept], tree.data[nearest[kept]], weights[kept], scale=False)
        following = correction.apply(moved)
        largest = float(np.sqrt(((following - moved) ** 2).sum(1).max()))
        reach = 1.001 * (np.partition(distance, keep - 1)[keep - 1] + largest)
        pose, moved = correction @ pose, following
        if largest < tolerance:
            return pose, SolveReport(Stop.CONVERGED, iteration + 1, iteration + 1, largest)
    return pose, SolveReport(Stop.STEP_LIMIT, options.iterations, options.iterations, largest)
