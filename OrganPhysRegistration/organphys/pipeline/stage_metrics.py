"""Numbers of one stage: distances between organ surface and splat, and volume and strain of the elastic one."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..align.metrics import strain_percentiles, surface_distances, volume_drift_percent
from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array
from ..ground.frames import Similarity
from ..points.neighbours import nearest_neighbours
from ..points.point_sets import Organ
from ..points.sampling import random_subset
from .case import Case
from .result_notices import SurfaceState

SAMPLE = 15_000  # vertices whose distance to the splat is taken after the coarse and the rigid stage

Metrics = dict[str, dict[str, float | str]]
"""{name: {"value", "unit"}}"""


def pose_metrics(case: Case, T_scene_ct: Similarity) -> Metrics:
    """Metrics of a stage without deformation; mm by the stated unit, else by the registered scale."""
    organ, tree = case.organ, case.target_tree
    sample = random_subset(len(organ.vertices), SAMPLE, 0)  # searches far from the target are slow
    mapped = T_scene_ct.apply(organ.vertices)
    to_splat = nearest_neighbours(tree, mapped[sample])[0]
    return _distances(organ.vertices, mapped, T_scene_ct.scale, tree, to_splat, case.stated_mm)


def elastic_metrics(registered: RegisteredOrgan, tree: cKDTree, to_splat: Array, gradients: Array) -> Metrics:
    """``to_splat`` (Nv,): distances of the registered vertices, scene units; ``gradients`` (Q, 3, 3): deformation
    gradients at the quadrature points."""
    metrics = _distances(
        registered.vertices, registered.scene_vertices, registered.T_scene_ct.scale, tree, to_splat,
        registered.mm_per_scene_unit,
    )  # fmt: skip
    stretches = strain_percentiles(gradients, (5, 95))
    return {
        **metrics,
        "volume_drift": {"value": volume_drift_percent(gradients), "unit": "%"},
        "min_det_F": {"value": float(np.linalg.det(gradients).min()), "unit": "1"},
        "largest_stretch_p95": {"value": float(stretches["largest_stretch"][1]), "unit": "1"},
        "smallest_stretch_p5": {"value": float(stretches["smallest_stretch"][0]), "unit": "1"},
    }


def surface_state(organ: Organ, registered: RegisteredOrgan, distance_mm: Array, gradients: Array) -> SurfaceState:
    """What the notices about the result look at; ``distance_mm`` (Nv,) from the registered vertices to the splat."""
    return SurfaceState(
        points=registered.scene_vertices,
        normals=registered.T_scene_ct.turn(organ.vertex_normals),
        displacement_mm=np.linalg.norm(registered.surface_displacement_mm, axis=1),
        distance_mm=distance_mm,
        radius_mm=float(np.sqrt(((organ.vertices - organ.vertices.mean(0)) ** 2).sum(1).mean())),
        det_f=np.linalg.det(gradients),
    )


def _distances(
    vertices: Array, mapped: Array, scale: float, tree: cKDTree, to_splat: Array, mm_per_unit: float | None
) -> Metrics:
    distances = surface_distances(
        mapped,
        tree.data,
        mm_per_unit=mm_per_unit or 1 / scale,
        box_mm=float(np.abs(vertices - vertices.mean(0)).max()),
        target_tree=tree,
        to_splat=to_splat,
    )
    return {**distances.as_metrics(), "scale": {"value": scale, "unit": "scene units per mm"}}
