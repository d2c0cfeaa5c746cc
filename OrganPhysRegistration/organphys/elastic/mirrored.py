"""Would the organ's mirror image fit as well? The test of handedness behind the verdict.

A splat that was mirrored on its way (a flipped axis, images flipped) fits a nearly symmetric organ nearly as well. The
mirror image of the CT organ, put where the organ itself would lie if it were turned over, then fits no worse.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..align.poses import Poses
from ..align.splat_view import SplatView
from ..align.two_way_fit import TwoWayFit
from ..ground.checks import Array
from ..ground.frames import Similarity
from .mode_choice import choose_mode
from .reduced_organ import ReducedOrgan

FLIP = np.array([-1.0, 1.0, 1.0])
ROUNDS = ((150, 0.2, 0.02, 6), (600, 0.12, 0.003, 10))  # points a side, robust width, damping, Gauss-Newton steps
BENT = 2  # of the starts, the best rigid ones, are bent


def mirrored_score(organ: ReducedOrgan, view: SplatView, pose: Similarity, *, seed: int = 0) -> float:
    """Lowest score of a short elastic fit of the organ's mirror image, near the registered ``pose``.

    pose: T_camera_normalised. No landmark and no unit bind the mirror image, so that it has every chance.
    """
    mirror = mirror_image(organ)
    grid = organ.samples.grid.mirrored()
    starts = Poses.of(mirror_starts(organ.samples.points, pose))
    for count, tau, damping, steps in ROUNDS:
        fit = TwoWayFit(mirror.samples, grid, view, count=count, seed=seed)
        for _ in range(steps):
            starts = fit.step(starts, tau, damping=damping, free_scale=True)
    splat, camera = fit.score(starts, ROUNDS[-1][1])
    best = np.argsort(splat + camera, kind="stable")[:BENT]
    return choose_mode(mirror, view, starts[best]).scores[0].total


def mirror_image(organ: ReducedOrgan) -> ReducedOrgan:
    """The organ in the mirror x -> -x of its normalised frame, in the same coordinates: x' = M X + Phi(X) Z.

    Its basis still belongs to the organ itself: only functions of the samples and the quadrature points are mirrored.
    """
    strains = organ.elasticity.phi_gradient.copy()
    strains[0] *= -1
    n = organ.basis.size
    signs = np.tile(FLIP, n)
    samples, elasticity = organ.samples, organ.elasticity
    return replace(
        organ,
        samples=replace(samples, points=samples.points * FLIP, normals=samples.normals * FLIP),
        elasticity=replace(elasticity, phi_gradient=strains, points=elasticity.points * FLIP),
        tangents=organ.tangents[::-1] * FLIP,  # swapped, so that their cross product points outward again
        phi_tangent=organ.phi_tangent[::-1],
        rest_hessian=organ.rest_hessian * signs[:, None] * signs,
    )


def mirror_starts(points: Array, pose: Similarity) -> list[Similarity]:
    """Poses of the mirror image that put it where ``pose`` puts the organ reflected in each of its principal planes.

    points (S, 3): the organ's surface, normalised. An organ that is nearly its own mirror image is so about one of the
    planes through its centre across a principal axis.
    """
    offsets = points - points.mean(0)
    axes = np.linalg.eigh(offsets.T @ offsets)[1].T
    reflected = [np.eye(3) - 2 * np.outer(axis, axis) for axis in axes]
    return [pose @ Similarity(1.0, matrix * FLIP, np.zeros(3)) for matrix in reflected]
