"""What follows from the elastic stage: the registered organ, its metrics and its warnings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..asset.baked_surface import BakedSurface
from ..asset.registered_organ import VOLUME_POINTS, RegisteredOrgan
from ..elastic.records import ElasticResult
from ..ground.checks import Array
from ..ground.notices import Notice
from ..mechanics.tissue import tissue_for
from ..points.neighbours import nearest_neighbours
from ..points.sampling import random_subset
from .case import Case
from .confidence_metrics import confidence_metrics
from .result_notices import SurfaceState, result_notices
from .stage_metrics import Metrics, elastic_metrics, surface_state


@dataclass(frozen=True)
class FinishedCase:
    """The registered organ; state: its surface against the splat; metrics and notices of the elastic stage."""

    organ: RegisteredOrgan
    state: SurfaceState
    metrics: Metrics
    notices: tuple[Notice, ...]


def finish_case(case: Case, elastic: ElasticResult, baked: BakedSurface | None = None) -> FinishedCase:
    """All that is taken from the deformation once it is found; ``baked``: the same basis at the same vertices."""
    organ = _registered_organ(case, elastic)
    if baked is not None:
        baked.give(organ)
    to_splat = nearest_neighbours(case.target_tree, organ.scene_vertices)[0]
    # the quadrature points lie inside, so the field beside the organ need not be baked
    gradients: Array = organ.deformation.inside(organ.quadrature_points)[1] + np.eye(3)
    state = surface_state(case.organ, organ, to_splat * organ.mm_per_unit, gradients)
    metrics = elastic_metrics(organ, case.target_tree, to_splat, gradients)
    metrics |= confidence_metrics(organ, state.seen(case.camera.position))
    notices = result_notices(
        state, case.camera.position, name=organ.name, volume_ml=organ.volume_ml, mm_per_unit=organ.mm_per_unit
    )
    return FinishedCase(organ, state, metrics, notices)


def _registered_organ(case: Case, elastic: ElasticResult) -> RegisteredOrgan:
    organ, quadrature = case.organ, elastic.normalisation.undo(elastic.quadrature_points)
    return RegisteredOrgan(
        T_scene_ct=elastic.T_scene_ct,
        normalisation=elastic.normalisation,
        basis=elastic.basis,
        z=elastic.z,
        vertices=organ.vertices,
        faces=organ.faces,
        volume_points=organ.volume_points[random_subset(len(organ.volume_points), VOLUME_POINTS, 0)],
        quadrature_points=quadrature,
        quadrature_weights=np.full(len(quadrature), 1 / len(quadrature)),
        volume_ml=organ.volume_ml,
        name=organ.name,
        tissue=vars(tissue_for(organ.name)),
        mm_per_scene_unit=case.stated_mm,
        provenance=dict(case.provenance),
        uncertainty=elastic.uncertainty,
    )
