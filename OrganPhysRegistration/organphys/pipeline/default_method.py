"""The stages of method="organphys": global start, choice of the mode by elastic fit, elastic solve with joint scale."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from time import perf_counter

import numpy as np

from ..align.landmark_prior import LandmarkPrior
from ..align.pose_view import pose_view
from ..align.poses import Poses
from ..align.splat_view import SplatView, splat_view
from ..align.start_search import Starts, search_start
from ..elastic.elastic_registration import ElasticOptions, ElasticState, register_elastically
from ..elastic.joint_scale import ScalePrior
from ..elastic.mirrored import mirrored_score
from ..elastic.mode_choice import choose_mode
from ..elastic.records import ElasticResult
from ..elastic.reduced_organ import ReducedOrgan, ReducedOrganOptions, reduce_organ
from ..ground.frames import Similarity
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..ground.solve_report import SolveReport, Stop
from ..points.surface_samples import SurfaceSamples, sample_surface
from .case import Case
from .default_stages import DefaultCoarse, DefaultRigid, mode_metrics, mode_notices
from .elastic_recorder import ElasticRecorder
from .fit_confidence import FitConfidence, fit_confidence
from .hand_pose import pose_near
from .method_memory import LevelEnd, MethodMemory
from .scale_checks import NEARLY_EXACT, plausible_scales, scale_prior, unit_notices, unit_scale
from .stages import ElasticStage, OnSurface

QUICK_STEPS = 6


ROUGH = 10  # handles of the organ that chooses among poses


class DefaultMethod:
    """The stages for one case; what several of them need is made once, when it is first needed.

    ``quick``: an elastic stage from a pose that it has not begun with before goes on from that pose's short fit, with
    a few steps of the last two levels alone; and the uncertainty of the result and the figures of the solver's steps
    are left out.
    """

    def __init__(self, case: Case, memory: MethodMemory | None = None, *, quick: bool = False) -> None:
        self.case, self.memory, self.quick = case, memory or MethodMemory(), quick

    def coarse(self, progress: Progress) -> DefaultCoarse:
        """Global search."""
        begin = perf_counter()
        progress("coarse", 0.0)
        starts, free_start = self._search(progress)
        pose = starts.poses.at(0)
        return DefaultCoarse(
            T_scene_ct=self._T_scene_ct(pose),
            view=pose_view(pose, self.samples, self.view),
            report=SolveReport(Stop.SEARCHED, starts.candidates),
            seconds={"coarse": perf_counter() - begin},
            notices=self.view.notices,
            starts=starts,
            free_start=free_start,
        )

    def rigid(self, coarse: DefaultCoarse, start: Similarity | None, progress: Progress) -> DefaultRigid:
        """The mode to which the organ bends most readily; a pose set by hand is refined and nothing else is tried."""
        begin = perf_counter()
        progress("basis", 0.0)
        organ = self.rough_organ
        ready = perf_counter()
        poses = coarse.starts.modes().poses if start is None else self._near(start)
        modes = choose_mode(
            organ, self.view, poses, landmarks=self.landmarks, scale_prior=self._scale_prior, progress=progress,
            known=self.memory.short_fits,
        )  # fmt: skip
        single = len(self.landmarks) == 1 and self.case.options.landmark_radius_mm is None
        radius_mm = self.landmarks.radius * self.samples.normalisation.length if single else None
        notices = (*self._unit_notices(coarse.free_start), *mode_notices(modes, organ, radius_mm))
        runner_up = modes.runner_up(organ)
        return DefaultRigid(
            T_scene_ct=self._T_scene_ct(modes.best),
            report=SolveReport(Stop.SEARCHED, len(modes.scores)),
            seconds={"basis": ready - begin, "rigid": perf_counter() - ready},
            notices=notices,
            by_hand=start is not None,
            pose=modes.best,
            score=modes.scores[0].total,
            runner_up=None if runner_up is None else runner_up.score.total,
            metrics=mode_metrics(modes, organ),
            runner_up_T=None if runner_up is None else self._T_scene_ct(runner_up.pose),
        )

    def elastic(
        self,
        coarse: DefaultCoarse,
        rigid: DefaultRigid,
        start: Similarity | None,
        progress: Progress,
        on_surface: OnSurface | None = None,
    ) -> ElasticStage:
        """Elastic solve; the rotation and translation it finds go into the similarity."""
        begin, organ = perf_counter(), self.organ
        options = ElasticOptions.stiffness(self.case.options.stiffness)
        recorder = ElasticRecorder(organ, self.view, options, progress, on_surface)
        pose = rigid.pose if start is None else self.camera_pose(start)
        state, report = self._bent(pose, options, recorder)
        state = state.without_rigid_part(organ)
        sure = self._sure_of(state, rigid, start, report)
        result = ElasticResult(
            T_scene_ct=self._T_scene_ct(state.pose),
            normalisation=self.samples.normalisation,
            basis=organ.basis,
            z=state.z,
            quadrature_points=organ.elasticity.points,
            steps=() if self.quick else recorder.figures,
            report=report,
            uncertainty=sure.uncertainty,
        )
        return ElasticStage(
            result=result, seconds={"elastic": perf_counter() - begin}, by_hand=start is not None, start=start,
            evidence=sure.evidence,
        )  # fmt: skip

    def _sure_of(
        self, state: ElasticState, rigid: DefaultRigid, start: Similarity | None, report: SolveReport
    ) -> FitConfidence:
        """How sure the result is; quick runs try the organ's mirror image only where that was done before."""
        key = (state.pose if start is not None else rigid.pose).key
        if key not in self.memory.mirrored and not self.quick:
            mirrored = mirrored_score(self.rough_organ, self.view, state.pose, seed=self.case.options.seed)
            self.memory.mirrored[key] = mirrored
        chosen = rigid if start is None else None
        return fit_confidence(
            self.organ, self.view, state, self.landmarks, self.case.unit, report, chosen,
            self.memory.mirrored.get(key), covariance=not self.quick,
        )  # fmt: skip

    def _bent(
        self, pose: Similarity, options: ElasticOptions, recorder: ElasticRecorder
    ) -> tuple[ElasticState, SolveReport]:
        """The elastic solve; the levels that were run before from the same pose are not run again."""
        done, end = self.memory.longest(pose, options.levels)
        short = self.memory.short_fits.get(pose.key) if self.quick and not done else None
        if short is not None:
            short = replace(short, z=self.organ.coordinates(self.rough_organ.displacement(self.organ, short.z)))
            done, end = max(len(options.levels) - 2, 0), LevelEnd(short, (), 0.0)
            options = replace(options, levels=tuple(replace(one, steps=QUICK_STEPS) for one in options.levels))
        recorder.resume(done, end)
        if end is not None and done == len(options.levels):
            recorder.progress("elastic", 1.0)
            return end.state, end.report(options.move_tolerance)
        state, report = register_elastically(
            self.organ, self.view, pose, scale_prior=self._scale_prior, on_step=recorder, landmarks=self.landmarks,
            options=replace(options, levels=options.levels[done:]), resume=None if end is None else end.state,
        )  # fmt: skip
        if report.stop is Stop.NO_DATA:
            return state, report
        for number, level_end in recorder.ends.items() if short is None else ():
            self.memory.keep(pose, options.levels[: number + 1], level_end)
        return state, recorder.ends[len(options.levels) - 1].report(options.move_tolerance)

    @cached_property
    def samples(self) -> SurfaceSamples:
        return sample_surface(self.case.organ, seed=self.case.options.seed)

    @cached_property
    def view(self) -> SplatView:
        scene = self.case.scene
        return splat_view(scene.centres, scene.others, self.case.camera, seed=self.case.options.seed)

    @cached_property
    def organ(self) -> ReducedOrgan:
        return reduce_organ(self.case.organ, self.samples, seed=self.case.options.seed)

    @cached_property
    def rough_organ(self) -> ReducedOrgan:
        """Few handles, which tell right poses from wrong ones as well, in a third of the time."""
        options = ReducedOrganOptions(handles=ROUGH)
        return reduce_organ(self.case.organ, self.samples, options=options, seed=self.case.options.seed)

    @cached_property
    def landmarks(self) -> LandmarkPrior:
        case, partners = self.case, None
        if np.isfinite(case.partners).any():
            partners = self.view.T_camera_scene.apply(case.partners)
        return LandmarkPrior.of(
            case.landmarks, self.samples, radius_mm=case.options.landmark_radius_mm, partners=partners
        )

    def _search(self, progress: Progress) -> tuple[Starts, Similarity]:
        """Starts that keep to the stated unit if there is one, and the best start of a search without it."""
        samples, view, unit, seed = self.samples, self.view, self.case.unit, self.case.options.seed
        free = search_start(samples, view, landmarks=self.landmarks, seed=seed, progress=progress)
        expected = unit_scale(unit, samples)
        if unit is None or expected is None:
            return free, free.poses.at(0)
        kept = search_start(
            samples, view, landmarks=self.landmarks, scale=self._exact_scale(),
            scale_range=plausible_scales(expected, unit.percent), seed=seed, progress=progress,
        )  # fmt: skip
        return kept, free.poses.at(0)

    def _near(self, start: Similarity) -> Poses:
        """The one pose T_camera_normalised that lies close to ``start`` = T_scene_ct."""
        pose, seed = self.camera_pose(start), self.case.options.seed
        return Poses.of([pose_near(pose, self.samples, self.view, scale=self._exact_scale(), seed=seed)])

    def _exact_scale(self) -> float | None:
        """Scene units per normalised length where the unit is known nearly exactly."""
        unit = self.case.unit
        return unit_scale(unit, self.samples) if unit is not None and unit.percent <= NEARLY_EXACT else None

    def _scale_prior(self, start: Similarity) -> ScalePrior:
        return scale_prior(start, unit_scale(self.case.unit, self.samples), self.case.unit)

    def _T_scene_ct(self, T_camera_normalised: Similarity) -> Similarity:
        T_normalised_ct = self.samples.normalisation.T_ct_normalised.inverse()
        return self.view.T_camera_scene.inverse() @ T_camera_normalised @ T_normalised_ct

    def camera_pose(self, T_scene_ct: Similarity) -> Similarity:
        """T_camera_normalised of a T_scene_ct."""
        return self.view.T_camera_scene @ T_scene_ct @ self.samples.normalisation.T_ct_normalised

    def _unit_notices(self, free_start: Similarity) -> tuple[Notice, ...]:
        """Whether a short elastic fit that does not know the unit contradicts it."""
        if self.case.unit is None:
            return ()
        state, _ = register_elastically(self.rough_organ, self.view, free_start, options=ElasticOptions.short())
        return unit_notices(state.pose.scale, self.samples, self.case.unit)
