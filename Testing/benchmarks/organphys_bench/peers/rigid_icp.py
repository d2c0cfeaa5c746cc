"""Weighted trimmed ICP of splat onto CT surface: rigid (the start's scale kept) or with scale.

What pipelines that register a reconstruction to CT do after an alignment by hand (MIS-NeRF, Table 1 of the OrganPhys
paper). Besl and McKay, PAMI 1992; the closest pairs only, as the splat has outliers (Chetverikov et al., Image and
Vision Computing 2005); pairs weigh 1 - d / d_max (Godin et al. 1994, in Rusinkiewicz and Levoy, "Efficient Variants of
the ICP Algorithm", 3DIM 2001, section 3.3). Every splat point looks for its CT point, never the other way round: the
splat lacks most of the organ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from organphys.ground.checks import Array
from organphys.ground.frames import Similarity, fit_similarity

from ..problem.outcome import Clock, Outcome
from ..problem.problem import Problem

SURFACE_POINTS = 20_000  # CT surface points searched: closer together than the splat is noisy


@dataclass(frozen=True)
class IcpOptions:
    """keep: share of the pairs kept; tolerance: largest move of a splat point, as a share of the organ's radius."""

    scale: bool
    keep: float = 0.8
    steps: int = 200
    tolerance: float = 1e-4


def rigid_icp(problem: Problem, clock: Clock) -> Outcome:
    """Six degrees of freedom."""
    return _registered(problem, clock, IcpOptions(scale=False))


def similarity_icp(problem: Problem, clock: Clock) -> Outcome:
    """Seven degrees of freedom."""
    return _registered(problem, clock, IcpOptions(scale=True))


def _registered(problem: Problem, clock: Clock, options: IcpOptions) -> Outcome:
    with clock.stage("start"):
        start = problem.start
    with clock.stage("icp"):
        T_scene_ct, steps = icp(problem.case.scene.target, surface_points(problem), start, options)
    return Outcome(T_scene_ct.apply, T_scene_ct, stages={"start": start}, facts={"icp_steps": steps})


def similarity_start(problem: Problem, clock: Clock) -> tuple[Similarity, dict[str, Similarity]]:
    """Where the deformable peers begin to deform, T_scene_ct after a similarity ICP; and the stages until then."""
    with clock.stage("start"):
        start = problem.start
    with clock.stage("icp"):
        T_scene_ct, _ = icp(problem.case.scene.target, surface_points(problem), start, IcpOptions(scale=True))
    return T_scene_ct, {"start": start, "icp": T_scene_ct}


def surface_points(problem: Problem) -> Array:
    """Points (N, 3) of the CT surface, RAS mm, uniform by area."""
    organ, rng = problem.organ, np.random.default_rng(problem.seed)
    corners = organ.vertices[organ.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    drawn = rng.choice(len(area), SURFACE_POINTS, p=area / area.sum())
    return np.einsum("nk,nkd->nd", rng.dirichlet([1.0, 1.0, 1.0], len(drawn)), corners[drawn])


def icp(target: Array, surface: Array, start: Similarity, options: IcpOptions) -> tuple[Similarity, int]:
    """T_scene_ct that fits CT ``surface`` (N, 3) mm to the splat ``target`` (M, 3), scene units; and steps taken."""
    tree, T_scene_ct = cKDTree(surface), start
    limit = options.tolerance * float(np.linalg.norm(surface - surface.mean(0), axis=1).mean())
    count = max(4, round(options.keep * len(target)))
    moved = T_scene_ct.inverse().apply(target)
    for step in range(options.steps):
        distance, nearest = tree.query(moved)
        kept = np.argpartition(distance, count - 1)[:count]
        weights = 1 - distance[kept] / (distance[kept].max() + np.finfo(float).tiny)
        T_scene_ct = fit(surface[nearest[kept]], target[kept], weights, T_scene_ct, options)
        following = T_scene_ct.inverse().apply(target)
        move = float(np.linalg.norm(following - moved, axis=1).max())
        moved = following
        if move < limit:
            return T_scene_ct, step + 1
    return T_scene_ct, options.steps


def fit(source: Array, target: Array, weights: Array, before: Similarity, options: IcpOptions) -> Similarity:
    """Weighted least squares of paired points (K, 3); without scale that of ``before`` is kept."""
    if options.scale:
        return fit_similarity(source, target, weights)
    scaled = before.scale * source
    motion = fit_similarity(scaled, target, weights, scale=False)
    return Similarity(before.scale, motion.rotation, motion.translation)
