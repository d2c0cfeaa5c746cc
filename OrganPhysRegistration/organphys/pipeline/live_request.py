"""The request "update" of the session server: what it changes, and the part of the outcome that goes back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..ground.checks import InputError, as_points
from ..points.point_sets import Landmarks
from .case import Case
from .case_outcome import CaseOutcome
from .outer_loop import landmarks_at


def changes_of(fields: Mapping[str, Any], case: Case) -> dict[str, Any]:
    """Keywords of ``RegistrationSession.updated`` for ``case``; InputError for what is no landmark or stiffness."""
    changes: dict[str, Any] = {}
    if "landmarks" in fields:
        changes["landmarks"] = _landmarks(fields["landmarks"], fields.get("names") or (), case)
    if "stiffness" in fields:
        stiffness = fields["stiffness"]
        if isinstance(stiffness, bool) or not isinstance(stiffness, (str, int, float)):
            raise InputError(f"update: stiffness must be a preset or a number, got {stiffness!r}"[:200])
        changes["stiffness"] = stiffness
    if not changes:
        raise InputError('update: name "landmarks" or "stiffness"')
    return changes


def live_part(outcome: CaseOutcome) -> CaseOutcome:
    """The elastic stage's surface with its figures: the other stages do not move while a user drags."""
    stage = outcome.stage
    only: dict[str, Any] = {
        name: {stage: getattr(outcome, name)[stage]} for name in ("similarities", "surfaces", "distance_mm")
    }
    return replace(outcome, **only, twists=None)


def _landmarks(positions: Any, names: Any, case: Case) -> Landmarks | None:
    if positions is None:
        return None
    points = as_points(positions, "landmarks", minimum=0)
    return landmarks_at(case, np.array(points), tuple(map(str, names))) if len(points) else None
