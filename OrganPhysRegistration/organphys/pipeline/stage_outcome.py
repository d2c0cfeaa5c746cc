"""Puts the outcome of a stage together."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..asset.asset_file import asset_bytes
from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array
from ..ground.frames import Similarity
from ..points.neighbours import nearest_neighbours
from .case_outcome import CaseOutcome
from .case_state import CaseState
from .processor import one_blas_thread


@one_blas_thread
def outcome_of(state: CaseState, before: CaseOutcome | None = None, *, live: bool = False) -> CaseOutcome:
    """Outcome of the last stage done; ``before``: an earlier one of the same case, whose distances are used again.

    ``live``: only what moves with the organ's surface, without inner points and asset, which take as long again.
    """
    case, poses = state.case, state.similarities
    surfaces = {name: T.apply(case.organ.vertices) for name, T in poses.items()}
    if state.finished is not None:
        surfaces["elastic"] = state.finished.organ.scene_vertices
    mm = {name: case.stated_mm or 1 / T.scale for name, T in poses.items()}
    distances = _known_distances(state, poses, before)
    for name in surfaces.keys() - distances.keys():
        distances[name] = nearest_neighbours(case.target_tree, surfaces[name])[0] * mm[name]
    view = state.stages["coarse"].view
    return CaseOutcome(
        stage=state.stage,
        similarities={name: T.matrix for name, T in poses.items()},
        vertices_ct=case.organ.vertices,
        faces=case.organ.faces,
        surfaces=surfaces,
        distance_mm={name: distances[name] for name in surfaces},
        mm_per_unit=mm[state.stage],
        unit_stated=case.stated_mm is not None,
        camera_position=case.camera.position,
        metrics=state.metrics,
        seconds=state.seconds,
        notices=tuple((notice.code, notice.message) for notice in state.notices),
        stops={name: stage.report.stop.value for name, stage in state.stages.items()},
        facts=state.facts,
        twists={
            "twists_deg": view.twists_deg.tolist(),
            "costs": view.twist_costs.tolist(),
            "cost_name": view.twist_cost_name,
            "chosen_deg": view.chosen_twist_deg,
        },
        **(_live_fields(state) if live else _elastic_fields(state)),
    )


def _known_distances(state: CaseState, poses: dict[str, Similarity], before: CaseOutcome | None) -> dict[str, Array]:
    """Distances of the stages whose pose is that of an earlier outcome, and of the elastic one."""
    known: dict[str, Array] = {}
    if before is not None:
        for name, matrix in before.similarities.items():
            if name in poses and name != "elastic" and np.array_equal(matrix, poses[name].matrix):
                known[name] = before.distance_mm[name]
    if state.finished is not None:
        known["elastic"] = state.finished.state.distance_mm
    return known


def _live_fields(state: CaseState) -> dict[str, Any]:
    if state.finished is None:
        return {}
    return {
        "steps": tuple(dict(vars(step)) for step in state.stages["elastic"].result.steps),
        "displacement_mm": state.finished.state.displacement_mm,
        "det_f": state.finished.organ.surface_det_f,
        "verdict": None if state.verdict is None else state.verdict.as_dict(),
    }


def _elastic_fields(state: CaseState) -> dict[str, Any]:
    if state.finished is None:
        return {}
    organ = state.finished.organ
    return {
        **_live_fields(state),
        **_confidence_fields(organ),
        "volume_ct": organ.volume_points,
        "volume_scene": organ.T_scene_ct.apply(
            organ.volume_points + organ.deformation.inside_displacement(organ.volume_points)
        ),
        "asset": asset_bytes(organ),
    }


def _confidence_fields(organ: RegisteredOrgan) -> dict[str, Any]:
    if organ.uncertainty is None:
        return {}
    return {"error_68_mm": organ.surface_error_mm(0.68), "error_95_mm": organ.surface_error_mm(0.95)}
