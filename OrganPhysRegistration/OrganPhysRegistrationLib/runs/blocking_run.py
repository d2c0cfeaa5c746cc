"""A registration in this process, for scripts that want to wait for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from organphys.ground.frames import Similarity
from organphys.ground.progress import Progress

from .gathered_case import GatheredCase, gather
from .run_inputs import RunInputs
from .stepped_work import run_at_once


def outcome_of_inputs(inputs: RunInputs, stages: Sequence[str], start: Any, progress: Progress) -> Any:
    """CaseOutcome after the last of ``stages``, with the transform's grids if that is the elastic one.

    ``start`` (4, 4): T_scene_ct set by hand that the first of ``stages`` begins with, None for none.
    """
    from organphys.exports.displacement_grid import sample_displacement

    session, outcome = _session(run_at_once(gather(inputs)), progress), None
    for stage in stages:
        by_hand: dict[str, Any] = {}
        if stage == stages[0] and stage != "coarse" and start is not None:
            by_hand["start"] = Similarity.of_matrix(np.asarray(start, dtype=np.float64))
        outcome = getattr(session, stage)(progress, **by_hand)
    if stages[-1] == "elastic":
        outcome = replace(outcome, grids=sample_displacement(session.registration.organ, progress=progress))
    return outcome


def _session(case: GatheredCase, progress: Progress) -> Any:
    from organphys.pipeline.registration import RegisterOptions
    from organphys.pipeline.session import RegistrationSession
    from organphys.readers.organ_from_mask import organ_from_mask

    organ = organ_from_mask(
        case.segment.mask,
        case.segment.ijk_to_ras,
        name=case.segment.name,
        opening=case.opening,
        close_holes=case.close_holes,
        progress=progress,
    )
    return RegistrationSession(
        organ,
        case.splat,
        RegisterOptions(**case.settings),
        landmarks=case.landmarks,
        camera=case.camera,
        box=case.box,
        unit=case.unit,
        provenance=case.provenance,
        progress=progress,
    )
