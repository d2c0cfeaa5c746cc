"""Optimal step non-rigid ICP on the surface by trimesh, after a similarity ICP.

Amberg, Romdhani, Vetter, "Optimal Step Nonrigid ICP Algorithms for Surface Registration", CVPR 2007, with trimesh's own
steps. Landmarks are known on the CT only, so that the landmark term is empty. Pairs farther apart than three median
distances of the start are dropped, in place of trimesh's 0.1 of the organ's size, which pulls the hidden side onto the
splat; other limits, stiffer steps and the seen side alone did no better (gallbladder, kidney, pancreas).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..problem.outcome import Clock, Outcome
from ..problem.problem import Problem
from ..problem.thin_surface import thinned
from .rigid_icp import similarity_start, surface_points
from .surface_extension import EXTENSION, extended

VERTICES = 1500
FARTHEST = 3.0  # median distances of the start
# stiffness, landmarks, exponent of the normals, most steps: trimesh's own default without landmarks
STEPS = ([0.01, 0, 0.5, 10], [0.02, 0, 0.5, 10], [0.03, 0, 0.5, 10], [0.01, 0, 0.0, 10])


def amberg(problem: Problem, clock: Clock) -> Outcome:
    """Surface registration, extended inside."""
    import trimesh

    T_scene_ct, stages = similarity_start(problem, clock)
    with clock.stage("non-rigid"):
        vertices, faces = thinned(problem.organ, VERTICES)
        mesh = trimesh.Trimesh(T_scene_ct.apply(vertices), faces, process=False)
        target = trimesh.PointCloud(problem.case.scene.target.copy())
        apart = np.median(cKDTree(T_scene_ct.apply(surface_points(problem))).query(problem.case.scene.target)[0])
        moved = trimesh.registration.nricp_amberg(
            mesh, target, use_faces=False, steps=STEPS, distance_threshold=FARTHEST * float(apart) / mesh.scale
        )
    with clock.stage("extension"):
        map_points = extended(vertices, np.asarray(moved), T_scene_ct)
    return Outcome(map_points, T_scene_ct, EXTENSION, stages, {"vertices": len(vertices)})
