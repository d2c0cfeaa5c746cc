"""What one stage gives to whoever shows it: surfaces, distances, figures and warnings, as plain arrays and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..exports.grid_records import DisplacementGrids
from ..ground.checks import Array


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
    per outer step; asset: content of the .organphys file; grids: where they were asked for; verdict: "level" ("trust",
    "check" or "do not trust"), "headline" and "reasons" (each "code", "level" and "message"); error_68_mm and
    error_95_mm (Nv,): radius within which the true position of a vertex lies with that probability, where known.
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
    verdict: Mapping[str, Any] | None = None
    error_68_mm: Array | None = None
    error_95_mm: Array | None = None
