"""Registering again after a small change: another landmark, another stiffness, another unit.

What does not depend on the change is taken over: the organ's samples, basis and lookup grid, the splat's view, the
poses found, every elastic level run before. A stiffness gives exactly what a full run gives. A moved landmark is
judged among the poses known so far, which a full run might add to; ``exact`` says whether it is settled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..ground.checks import Array
from ..ground.frames import Similarity
from ..ground.progress import Progress
from ..points.point_sets import Landmarks, SceneUnit
from .case import Case
from .default_method import DefaultMethod
from .default_stages import DefaultCoarse
from .landmark_checks import checked_landmarks, checked_partners
from .method_memory import MethodMemory
from .stages import OnSurface
from .start_pool import StartPool, coarse_of

UNCHANGED: Any = object()
SHARED = ("samples", "view", "organ", "rough_organ")  # of a method: they depend on organ, splat, camera and seed alone


@dataclass(frozen=True)
class Changes:
    """What is different now; ``landmarks`` and ``unit`` may also be taken away (None)."""

    landmarks: Landmarks | None = UNCHANGED
    stiffness: str | float = UNCHANGED
    unit: SceneUnit | None = UNCHANGED

    def case(self, case: Case) -> Case:
        """The changed case; InputError tells what cannot be used."""
        changed = case
        if self.landmarks is not UNCHANGED:
            positions, told = checked_landmarks(self.landmarks, case.organ)
            notices = tuple(notice for notice in case.notices if notice.code != "landmark_projected")
            partners = checked_partners(self.landmarks, case.scene.centres)
            changed = replace(changed, landmarks=positions, partners=partners, notices=(*notices, *told))
        if self.stiffness is not UNCHANGED:
            changed = replace(changed, options=replace(case.options, stiffness=self.stiffness))
        if self.unit is not UNCHANGED:
            changed = replace(changed, unit=self.unit)
        if "target_tree" in vars(case):
            vars(changed)["target_tree"] = case.target_tree
        return changed


@dataclass(frozen=True)
class OuterLoop:
    """``pool``: poses known, None before the first search; ``exact``: a full run would know no others."""

    pool: StartPool | None = None
    exact: bool = True

    def known(self, method: DefaultMethod, coarse: DefaultCoarse) -> OuterLoop:
        """With the poses of a coarse stage."""
        pool = StartPool.of(coarse.starts, method.landmarks, method.view)
        return replace(self, pool=pool if self.pool is None else self.pool.joined(pool))

    def prepared(self, method: DefaultMethod, coarse: DefaultCoarse, progress: Progress) -> OuterLoop:
        """With those of a search without landmarks, whose short elastic fits the method remembers: some seconds."""
        found, free = self if self.pool is not None else self.known(method, coarse), method
        if len(method.landmarks):
            free = taken_over(method, replace(method.case, landmarks=np.zeros((0, 3)), partners=np.zeros((0, 3))))
            coarse = free.coarse(progress)
            found = found.known(free, coarse)
        free.rigid(coarse, None, progress)
        return found

    def update(
        self,
        method: DefaultMethod,
        stages: Mapping[str, Any],
        progress: Progress,
        on_surface: OnSurface | None,
        *,
        landmarks_moved: bool,
    ) -> dict[str, Any]:
        """The stages of the changed case, whose ``method`` comes from ``taken_over``, from those before the change."""
        coarse, rigid, elastic = stages["coarse"], stages["rigid"], stages["elastic"]
        start: Similarity | None = elastic.start
        if landmarks_moved and self.pool is not None and not rigid.by_hand and start is None:
            coarse = coarse_of(self.pool.starts(method.landmarks, method.view), coarse, method.samples, method.view)
            rigid = method.rigid(coarse, None, progress)
        return {
            "coarse": coarse,
            "rigid": rigid,
            "elastic": method.elastic(coarse, rigid, start, progress, on_surface),
        }


def taken_over(method: DefaultMethod, case: Case, *, quick: bool = False) -> DefaultMethod:
    """The method for a changed case with all that does not depend on the change; ``quick``: see DefaultMethod."""
    same_data = case.unit == method.case.unit and np.array_equal(case.partners, method.case.partners, equal_nan=True)
    changed = DefaultMethod(case, method.memory if same_data else MethodMemory(), quick=quick)
    vars(changed).update({name: vars(method)[name] for name in SHARED if name in vars(method)})
    return changed


def _pairs(case: Case) -> bytes:
    """The landmarks that are known on the splat too: they pull at the organ, so that elastic fits depend on them."""
    paired = np.isfinite(case.partners).all(axis=1)
    return case.landmarks[paired].tobytes() + case.partners[paired].tobytes()


def landmarks_at(case: Case, positions: Array, names: tuple[str, ...] = ()) -> Landmarks:
    """Landmarks at ``positions`` (L, 3) RAS mm; those of the case that are known on the splat stay so, where the number
    of landmarks is the same."""
    paired = np.flatnonzero(np.isfinite(case.partners).all(axis=1))
    if not len(paired) or len(positions) != len(case.partners):
        return Landmarks(positions, names)
    return Landmarks(positions, names, points_scene=case.partners[paired], pairs=tuple(map(int, paired)))
