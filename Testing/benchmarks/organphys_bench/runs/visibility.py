"""A case of which less is seen: its own splat cut, or one made anew with a chosen share of the organ's surface."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from organphys.ground.checks import Array
from organphys.ground.frames import fit_similarity
from organphys.pipeline.evaluation import Truth
from organphys.points.point_sets import GaussianCloud

from ..peers.surface_extension import extended

if TYPE_CHECKING:
    from case_inputs import CaseInputs

GAUSSIANS = 40_000
NOISE_MM = 0.3
OPAQUE = 0.1  # Gaussians above this opacity are surface


def cut_share(case: CaseInputs, rng: np.random.Generator, *, percent: float) -> CaseInputs:
    """The case's own opaque splat on one side of a plane through the camera, in a random direction, so that ``percent``
    of the organ's surface is left in it; the case as it is where it shows no more than that."""
    truth, splat, angle = case.truth, case.splat, rng.uniform(0, 2 * np.pi)
    left = round(percent / 100 * np.count_nonzero(truth.region < 2))
    ranked = np.sort(_sideways(truth.points_scene[truth.region == 0], angle))[::-1]
    if left >= len(ranked):
        return case
    kept = np.flatnonzero(splat.valid & (splat.opacities > OPAQUE))
    kept = kept[_sideways(np.asarray(splat.centres[kept], float), angle) > ranked[left]]
    valid = np.ones(len(kept), bool)
    return replace(case, splat=GaussianCloud(splat.centres[kept], splat.opacities[kept], splat.colours[kept], valid))


def _sideways(points: Array, angle: float) -> Array:
    """Image coordinates (N,) of points (N, 3) in the direction ``angle``."""
    return points[:, :2] / points[:, 2:] @ np.array([np.cos(angle), np.sin(angle)])


def seen_share(case: CaseInputs, rng: np.random.Generator, *, percent: float) -> CaseInputs:
    """A splat on the ``percent`` of the true surface that lies most to the side of what the case itself shows.

    The true surface is the CT's, moved as the truth's points were (thin-plate spline between them). Noise: white and
    waves of 14 mm, 0.3 mm each, along the rays; no outliers, no other organs, hence no crop box.
    """
    from stress import noise

    surface = true_surface(case)
    faces = seen_faces(surface, case.organ.faces, case.truth, percent)
    corners = surface[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    drawn = rng.choice(len(area), GAUSSIANS, p=area / area.sum())
    centres = np.einsum("nk,nkd->nd", rng.dirichlet([1.0, 1.0, 1.0], GAUSSIANS), corners[drawn])
    splat = GaussianCloud(centres, np.full(GAUSSIANS, 0.9), np.full((GAUSSIANS, 3), 0.5), np.ones(GAUSSIANS, bool))
    return noise(replace(case, splat=splat, box=None), rng, sd_mm=NOISE_MM)


def true_surface(case: CaseInputs) -> Array:
    """The organ's vertices (Nv, 3) where they truly lie, scene units."""
    truth = case.truth
    T_scene_ct = fit_similarity(truth.points_ct, truth.points_scene)
    return extended(truth.points_ct, truth.points_scene, T_scene_ct)(case.organ.vertices)


def seen_faces(surface: Array, faces: NDArray[np.int64], truth: Truth, percent: float) -> NDArray[np.int64]:
    """The triangles that make up ``percent`` of the area, in order of their angle, seen from the organ's middle, to the
    middle of the truth's visible points."""
    middle = surface.mean(0)
    axis = truth.points_scene[truth.region == 0].mean(0) - middle
    corners = surface[faces]
    outward = corners.mean(1) - middle
    order = np.argsort(-(outward @ axis) / np.linalg.norm(outward, axis=1), kind="stable")
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)[order]
    count = int(np.searchsorted(np.cumsum(area), percent / 100 * area.sum())) + 1
    return faces[order[:count]]
