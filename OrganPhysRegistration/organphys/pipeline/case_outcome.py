"""What one stage gives to whoever shows it: surfaces, distances, figures and warnings, as plain arrays and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..asset.asset_file import asset_bytes
from ..exports.displacement_grid import DisplacementGrids
from ..ground.checks import Array
from ..points.neighbours import nearest_neighbours
from .case_state import CaseState
from .processor import one_blas_thread


@dataclass(frozen=True)
class CaseOutcome:
    """The case after ``stage`` ("coarse", "rigid" or "elastic"). Stages below: "before" and those done.

    similarities {stage: (4, 4)}: T_scene_ct; vertices_ct (Nv, 3) RAS mm, faces (Nf, 3); surfaces {stage: (Nv, 3)}
    scene units; distance_mm {stage: (Nv,)}: from them to the splat, mm by the stated unit, else by that stage's scale;
    mm_per_unit: as stated, else 1 / scale of the last stage; unit_stated: which of the two; camera_position (3,) scene
    units; metrics {stage: {name: {"value", "unit"}}}; seconds {part: s}; notices: (code, message); stops {stage: why
    it ended}; twists: twists_deg, costs, cost_name, chosen_deg of the coarse pose turned about the viewing axis; facts:
    label and text of the inputs.

    After the elastic stage only: displacement_mm (Nv,) beyond the similarity and det_f (Nv,) at the vertices;
    volume_ct (N, 3) RAS mm and volume_scene (N, 3): points inside, N <= 30000; steps: the fields of ElasticStep, one
    per outer step; asset: content of the .organphys file; grids: where they were asked for.
    """

    stage: str
    similarities: Mapping[str, Array]
    vertices_ct: Array
    faces: NDArray[np.integer]
    surfaces: Mapping[str, Array]
    distance_mm: Mapping[str, Array]
    mm_per_unit: float
    unit_stated: bool
    camera_position: Array
    metrics: Mapping[str, Mapping[str, Mapping[str, float | str]]]
    seconds: Mapping[str, float]
    notices: tuple[tuple[str, str], ...]
    stops: Mapping[str, str]
    facts: Mapping[str, str]
    twists: Mapping[str, Any] | None = None
    steps: tuple[Mapping[str, float], ...] = ()
    displacement_mm: Array | None = None
    det_f: Array | None = None
    volume_ct: Array | None = None
    volume_scene: Array | None = None
    asset: bytes | None = field(default=None, repr=False)
    grids: DisplacementGrids | None = None


@one_blas_thread
def outcome_of(state: CaseState) -> CaseOutcome:
    """Outcome of the last stage done."""
    case, poses = state.case, state.similarities
    surfaces = {name: T.apply(case.organ.vertices) for name, T in poses.items()}
    if state.finished is not None:
        surfaces["elastic"] = state.finished.organ.scene_vertices
    mm = {name: case.stated_mm or 1 / T.scale for name, T in poses.items()}
    view = state.stages["coarse"].view
    return CaseOutcome(
        stage=state.stage,
        similarities={name: T.matrix for name, T in poses.items()},
        vertices_ct=case.organ.vertices,
        faces=case.organ.faces,
        surfaces=surfaces,
        distance_mm={name: nearest_neighbours(case.target_tree, surfaces[name])[0] * mm[name] for name in surfaces},
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
        **_elastic_fields(state),
    )


def _elastic_fields(state: CaseState) -> dict[str, Any]:
    if state.finished is None:
        return {}
    organ = state.finished.organ
    return {
        "steps": tuple(dict(vars(step)) for step in state.stages["elastic"].result.steps),
        "displacement_mm": state.finished.state.displacement_mm,
        "det_f": organ.surface_det_f,
        "volume_ct": organ.volume_points,
        "volume_scene": organ.T_scene_ct.apply(organ.volume_points + organ.deformation.inside(organ.volume_points)[0]),
        "asset": asset_bytes(organ),
    }
