"""A registration stage by stage: coarse, rigid, elastic, each repeatable, with poses set by hand between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any

from ..asset.baked_surface import BakedSurface
from ..ground.checks import Array, InputError, one_of
from ..ground.frames import Similarity
from ..ground.progress import Progress, no_progress
from ..ground.solve_report import SolveReport, Stop
from ..points.point_sets import Box, Camera, GaussianCloud, Landmarks, Organ, SceneUnit
from .case import Case
from .case_outcome import CaseOutcome
from .case_state import CaseState
from .default_method import DefaultMethod
from .landmark_weights import landmark_weights
from .live_surface import LiveSurface
from .organ_in_scene import organ_in_scene
from .outer_loop import UNCHANGED, Changes, OuterLoop, taken_over
from .paper_method import PaperMethod
from .processor import one_blas_thread
from .registration import RegisterOptions, Registration
from .stage_outcome import outcome_of
from .stages import STAGES, Method, RigidStage

__all__ = ["RegistrationSession", "landmark_weights"]

METHODS: dict[str, Callable[[Case], Method]] = {"organphys": DefaultMethod, "paper": PaperMethod}


class RegistrationSession:
    """One case between its stages; ``register`` is the three of them in a row.

    A stage runs those before it that are missing; a stage run again drops those after it. One that fails or is
    cancelled leaves the session as it was.
    """

    def __init__(
        self,
        organ: Organ,
        splat: GaussianCloud,
        options: RegisterOptions | None = None,
        *,
        landmarks: Landmarks | None = None,
        camera: Camera | None = None,
        box: Box | None = None,
        unit: SceneUnit | None = None,
        provenance: Mapping[str, Any] | None = None,
        progress: Progress = no_progress,
    ) -> None:
        """Arguments as of ``register``; InputError tells what is wrong with the input."""
        self._began, self.box = perf_counter(), box
        case = Case.of(
            organ, splat, options, landmarks=landmarks, camera=camera, box=box, unit=unit, provenance=provenance,
            progress=progress,
        )  # fmt: skip
        if box is None and case.options.method == "organphys":
            case = organ_in_scene(case, progress)
        self.state = CaseState(case)
        self._outcome: CaseOutcome | None = None
        self._method: Method = METHODS[case.options.method](case)
        self._loop = OuterLoop()
        self._baked: BakedSurface | None = None

    def coarse(self, progress: Progress = no_progress) -> CaseOutcome:
        """Global search for the pose."""
        self.advance("coarse", progress)
        return self._told()

    def rigid(self, progress: Progress = no_progress, *, start: Similarity | None = None) -> CaseOutcome:
        """Rigid fit of the coarse pose; or of ``start`` = T_scene_ct set by hand, which it stays close to."""
        self.advance("rigid", progress, start=start)
        return self._told()

    def elastic(
        self,
        progress: Progress = no_progress,
        *,
        start: Similarity | None = None,
        on_surface: Callable[[Array], None] | None = None,
    ) -> CaseOutcome:
        """Elastic fit from the rigid pose, or from ``start`` = T_scene_ct set by hand as it is.

        ``on_surface`` is shown the vertices (Nv, 3) of the bending surface in scene units, at most five times a
        second, carried along by the solver's samples (see ``LiveSurface``).
        """
        self.advance("elastic", progress, start=start, on_surface=on_surface)
        return self._told()

    @one_blas_thread
    def updated(
        self,
        progress: Progress = no_progress,
        *,
        landmarks: Landmarks | None = UNCHANGED,
        stiffness: str | float = UNCHANGED,
        unit: SceneUnit | None = UNCHANGED,
        on_surface: Callable[[Array], None] | None = None,
    ) -> CaseOutcome:
        """Register again with what is named changed; the stages not done yet are run as well.

        A change of stiffness gives what a full run gives, and a moved landmark too if the right pose is among those
        known (``prepare_updates``); ``settled`` makes sure. Another unit, and the paper's method, are a full run.
        The outcome holds what moves with the surface only; inner points, uncertainty and asset are in ``settled``.
        """
        changes = Changes(landmarks, stiffness, unit)
        case = changes.case(self.state.case)
        show = None if on_surface is None else LiveSurface(case.organ.vertices, on_surface)
        method, loop, stages = self._method, self._loop, self.state.stages
        if isinstance(method, DefaultMethod) and "elastic" in stages and unit is UNCHANGED:
            loop = loop if loop.pool is not None else loop.known(method, stages["coarse"])
            quick = taken_over(method, case, quick=True)
            moved = landmarks is not UNCHANGED
            stages = loop.update(quick, stages, progress, show, landmarks_moved=moved)
            self._take(case, quick, replace(loop, exact=loop.exact and not moved), stages)
        else:
            afresh = self._afresh(case)
            self._take(case, afresh, OuterLoop(), self._all_stages(afresh, progress, show))
        return self._told(live=True)

    def settled(self, progress: Progress = no_progress) -> CaseOutcome:
        """The whole outcome after ``updated``; see ``settle``."""
        self.settle(progress)
        return self._told()

    @one_blas_thread
    def settle(self, progress: Progress = no_progress) -> None:
        """Make up for what ``updated`` left out: the search, if landmarks have moved since the last one, and the
        uncertainty."""
        exact, method, stages = self._loop.exact, self._method, self.state.stages
        if exact and not (isinstance(method, DefaultMethod) and method.quick):
            return
        case = self.state.case
        afresh = self._afresh(case)
        if exact:  # the solver's levels are remembered
            elastic = afresh.elastic(stages["coarse"], stages["rigid"], stages["elastic"].start, progress, None)
            stages = {**stages, "elastic": elastic}
        else:
            stages = self._all_stages(afresh, progress, None)
        self._take(case, afresh, replace(self._loop, exact=True), stages)

    @one_blas_thread
    def prepare_updates(self, progress: Progress = no_progress) -> None:
        """Get to know more poses, so that a moved landmark finds its own among them: a search and some short fits."""
        if isinstance(self._method, DefaultMethod) and "coarse" in self.state.stages:
            self._loop = self._loop.prepared(self._method, self.state.stages["coarse"], progress)
        self._bake()

    @property
    def default_method(self) -> DefaultMethod:
        """The method's own state, for whoever follows the organ on; InputError for another method."""
        if not isinstance(self._method, DefaultMethod):
            raise InputError("method: expected organphys, which alone can be followed on")
        return self._method

    @property
    def registration(self) -> Registration:
        """Registered organ and all that the report tells; InputError before the elastic stage."""
        return replace(self.state.registration, began=self._began)

    @one_blas_thread
    def advance(
        self,
        stage: str,
        progress: Progress = no_progress,
        *,
        start: Similarity | None = None,
        on_surface: Callable[[Array], None] | None = None,
    ) -> None:
        """Run one of STAGES without putting its outcome together."""
        one_of(stage, "stage", STAGES)
        done = dict(self.state.stages)
        if stage == "coarse" or "coarse" not in done:
            done = {"coarse": self._method.coarse(progress)}
        if stage == "rigid":
            done = {"coarse": done["coarse"], "rigid": self._method.rigid(done["coarse"], start, progress)}
        if stage == "elastic":
            rigid = done.get("rigid") or self._rigid_unasked(done["coarse"], start, progress)
            show = None if on_surface is None else LiveSurface(self.state.case.organ.vertices, on_surface)
            elastic = self._method.elastic(done["coarse"], rigid, start, progress, show)
            done = {"coarse": done["coarse"], "rigid": rigid, "elastic": elastic}
        self.state = self.state.followed_by(done)

    def _told(self, *, live: bool = False) -> CaseOutcome:
        self._outcome = outcome_of(self.state, self._outcome, live=live)
        return self._outcome

    def _take(self, case: Case, method: Method, loop: OuterLoop, stages: Mapping[str, Any]) -> None:
        """Go on from a changed case."""
        state = self.state.changed(case).followed_by(stages, self._baked)
        self.state, self._method, self._loop = state, method, loop
        self._bake()

    def _bake(self) -> None:
        """Bake the basis at the vertices, once the organ is known to be registered again and again."""
        elastic = self.state.stages.get("elastic")
        if self._baked is None and elastic is not None:
            result = elastic.result
            self._baked = BakedSurface.of(result.basis, result.normalisation, self.state.case.organ.vertices)

    def _afresh(self, case: Case) -> Method:
        if isinstance(self._method, DefaultMethod):
            return taken_over(self._method, case)
        return METHODS[case.options.method](case)

    def _all_stages(self, method: Method, progress: Progress, show: LiveSurface | None) -> dict[str, Any]:
        """All of them from the start, except where a pose was set by hand."""
        before = self.state.stages
        if any(getattr(stage, "by_hand", False) for stage in before.values()):
            coarse, rigid, start = before["coarse"], before["rigid"], getattr(before.get("elastic"), "start", None)
        else:
            coarse = method.coarse(progress)
            rigid, start = method.rigid(coarse, None, progress), None
        return {"coarse": coarse, "rigid": rigid, "elastic": method.elastic(coarse, rigid, start, progress, show)}

    def _rigid_unasked(self, coarse: Any, start: Similarity | None, progress: Progress) -> RigidStage:
        """The rigid stage where it was left out; a pose set by hand stands for it."""
        if start is not None:
            return RigidStage(T_scene_ct=start, report=SolveReport(Stop.BY_HAND, 0), by_hand=True)
        rigid: RigidStage = self._method.rigid(coarse, None, progress)
        return rigid
