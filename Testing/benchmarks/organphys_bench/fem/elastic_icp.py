"""FEM elastic ICP with the data terms of OrganPhys's default method, and with those of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from organphys.align.metrics import trimmed_mean
from organphys.align.splat_view import SplatView
from organphys.elastic.data_terms import DataOptions
from organphys.elastic.elastic_registration import ElasticLevel, find_matches
from organphys.elastic.matches import Deformed, Matches
from organphys.elastic.paper_model import PaperElasticOptions
from organphys.elastic.paper_objective import correspondences
from organphys.ground.checks import Array
from organphys.ground.frames import Similarity
from organphys.points.sampling import random_subset
from organphys.points.surface_samples import SurfaceSamples

from .assembly import Elasticity
from .newton import Springs, minimise
from .organ_mesh import Carried, OrganMesh

# The default method's levels with elastic energy alone; its last alpha is for the load prior, this one for energy.
LEVELS = (
    ElasticLevel(0.4, 0.15, 8, 0.0),
    ElasticLevel(0.1, 0.12, 10, 0.0),
    ElasticLevel(0.04, 0.12, 14, 0.0),
    ElasticLevel(0.015, 0.12, 20, 0.0),
)
INNER_STEPS, INNER_TOLERANCE = 6, 1e-10  # those of the reduced solver
MOVE_TOLERANCE = 5e-4
ORGAN_POINTS = 2200


@dataclass(frozen=True)
class FemOrgan:
    """Surface samples carried by the mesh, as ``find_matches`` wants them."""

    mesh: OrganMesh
    samples: SurfaceSamples
    carried: Carried

    @classmethod
    def of(cls, mesh: OrganMesh, samples: SurfaceSamples) -> FemOrgan:
        return cls(mesh, samples, mesh.carry(samples.points))

    def deformed(self, u: Array, gamma: float, start: Similarity) -> Deformed:
        gradients = self.mesh.gradients(u)[self.carried.cells]
        columns = gradients.transpose(2, 0, 1)
        cofactor = (np.cross(columns[k - 2], columns[k - 1]) for k in range(3))  # Nanson's formula
        normals = sum(c * self.samples.normals[:, k, None] for k, c in enumerate(cofactor))
        normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        return Deformed(self.samples.points + self.mesh.moved(self.carried, u), normals, gamma, start)

    def springs(self, matches: Matches, points: Array, gamma: float) -> Springs:
        """The data terms, scale free and without its bias (as ``joint_scale.data_quadratic``)."""
        rows, metric = matches.rows, matches.metric()
        residual = points[rows] - gamma * matches.targets
        data = float(np.einsum("ka,kab,kb->", residual, metric, residual))
        carried = Carried(self.carried.cells[rows], self.carried.barycentric[rows])
        return Springs(carried, self.samples.points[rows], matches.targets, metric, -2 * data / gamma, scale=True)


def elastic_icp(
    organ: FemOrgan, elastic: Elasticity, view: SplatView, start: Similarity
) -> tuple[Array, float, dict[str, Any]]:
    """Nodal displacements (N, 3), gamma and how it went, from ``start`` = T_camera_normalised."""
    chosen = random_subset(len(organ.samples.points), ORGAN_POINTS, 0)
    u, gamma, outer, inner, matching = np.zeros_like(organ.mesh.nodes), 1.0, 0, 0, 0.0
    for level in LEVELS:
        for _ in range(level.steps):
            shape, begin = organ.deformed(u, gamma, start), process_time()
            matches = find_matches(organ, shape, view, chosen, level.tau, DataOptions())
            matching += process_time() - begin
            springs, before = organ.springs(matches, shape.points, gamma), (u, gamma)
            u, gamma, steps = minimise(
                elastic, level.alpha, springs, u, gamma, steps=INNER_STEPS, tolerance=INNER_TOLERANCE
            )
            outer, inner = outer + 1, inner + steps
            move = np.abs(organ.mesh.moved(organ.carried, u - before[0])).max() + abs(gamma - before[1])
            if move < MOVE_TOLERANCE:
                break
    facts = {"outer_steps": outer, "newton_steps": inner, "last_move": float(move), "matching_processor_s": matching}
    return u, gamma, facts


def paper_elastic_icp(
    mesh: OrganMesh, elastic: Elasticity, surface: Array, target: Array, options: PaperElasticOptions
) -> tuple[Array, dict[str, Any]]:
    """The paper's elastic ICP (section 3.6) on tetrahedra: every surface point (S, 3) to its nearest ``target`` (M, 3).

    All in the paper's normalised frame. Returns nodal displacements (N, 3) and how it went.
    """
    tree, carried, u, outer, inner = cKDTree(target), mesh.carry(surface), np.zeros_like(mesh.nodes), 0, 0
    curve = []
    for alpha in options.alphas:
        for _ in range(options.outer_steps):
            before = surface + mesh.moved(carried, u)
            matched, weights = correspondences(before, tree, sigma=options.sigma, keep=options.keep)
            springs = Springs(carried, surface, matched, weights[:, None, None] * np.eye(3))
            u, _, steps = minimise(
                elastic, alpha, springs, u, 1.0, steps=options.inner_steps, tolerance=options.gradient_tolerance
            )
            after = surface + mesh.moved(carried, u)
            outer, inner = outer + 1, inner + steps
            drift = 100 * float(elastic.weights @ np.linalg.det(mesh.gradients(u)) / elastic.weights.sum() - 1)
            curve.append([alpha, trimmed_mean(cKDTree(after).query(target)[0]), drift])
            if np.linalg.norm(after - before, axis=1).max() < options.tolerance:
                break
    return u, {"outer_steps": outer, "newton_steps": inner, "alpha_trim30_drift": curve}
