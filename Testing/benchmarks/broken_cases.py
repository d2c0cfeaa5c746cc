"""Deliberately broken inputs: each takes a good case and gives one whose registration must not be trusted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from case_inputs import CaseInputs
from scipy.spatial import cKDTree
from stress import _opaque, _with_splat

from organphys.points.point_sets import Landmarks

Break = Callable[[CaseInputs, np.random.Generator], CaseInputs]
FLIP = np.array([-1.0, 1.0, 1.0])


def landmarks_on_the_wrong_side(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """As many landmarks as there are, among the fifth of the hidden surface that lies farthest from all seen places."""
    truth, count = case.truth, len(case.landmarks.positions)
    seen, hidden = (truth.points_ct[truth.region == region] for region in (0, 1))
    away = cKDTree(seen).query(hidden)[0]
    far = hidden[away >= np.quantile(away, 0.8)]
    return replace(case, landmarks=Landmarks(far[rng.choice(len(far), count, replace=False)]))


def mirrored_splat(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """The scene and its crop box are mirrored left to right; no landmarks."""
    splat, box = replace(case.splat, centres=case.splat.centres * FLIP.astype(case.splat.centres.dtype)), case.box
    if box is not None:
        box = replace(box, centre=box.centre * FLIP, axes=box.axes * FLIP)
    return replace(case, splat=splat, box=box, landmarks=None)


def tenth_seen(case: CaseInputs, rng: np.random.Generator) -> CaseInputs:
    """Only a patch of the splat is left, of a tenth of the organ's surface, round a random seen place."""
    truth, opaque = case.truth, _opaque(case.splat)
    seen, surface = truth.points_scene[truth.region == 0], int((truth.region < 2).sum())
    middle = seen[rng.integers(len(seen))]
    away = np.sort(np.linalg.norm(seen - middle, axis=1))
    radius = away[min(surface // 10, len(away) - 1)]
    return _with_splat(case, opaque[np.linalg.norm(opaque - middle, axis=1) < radius])


def wrong_organ(other: CaseInputs) -> Callable[[CaseInputs], CaseInputs]:
    """The organ of another case, without landmarks."""
    return lambda case: replace(case, organ=other.organ, landmarks=None)


BREAKS: dict[str, Break] = {
    "landmarks on the wrong side": landmarks_on_the_wrong_side,
    "mirrored splat": mirrored_splat,
    "10 % seen": tenth_seen,
}
