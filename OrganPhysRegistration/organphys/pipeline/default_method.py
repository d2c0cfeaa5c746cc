"""The stages of method="organphys": global start, choice of the mode by elastic fit, elastic solve with joint scale."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ..align.landmark_prior import ON_SURFACE, LandmarkPrior
from ..align.pose_view import pose_view
from ..align.splat_view import SplatView, splat_view
from ..align.start_search import Starts, search_start
from ..elastic.elastic_registration import SHORT, ElasticOptions, ElasticState, register_elastically
from ..elastic.joint_scale import ScalePrior
from ..elastic.mode_choice import Modes, choose_mode
from ..elastic.records import ElasticResult, ElasticStep
from ..elastic.reduced_organ import ReducedOrgan, reduce_organ
from ..ground.checks import Array
from ..ground.frames import Similarity
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..ground.solve_report import SolveReport, Stop
from ..points.point_sets import Camera, Organ, SceneUnit
from ..points.surface_samples import SurfaceSamples, sample_surface
from .elastic_recorder import ElasticRecorder
from .registration import AMBIGUOUS, MethodResult, RegisterOptions
from .scale_checks import NEARLY_EXACT, plausible_scales, scale_prior, unit_notices, unit_scale
from .scene import Scene


@dataclass(frozen=True)
class _Stages:
    """What the stages found, in the camera and normalised CT frames."""

    samples: SurfaceSamples
    view: SplatView
    starts: Starts
    organ: ReducedOrgan
    modes: Modes
    state: ElasticState
    report: SolveReport
    steps: tuple[ElasticStep, ...]

    def T_scene_ct(self, T_camera_normalised: Similarity) -> Similarity:
        T_normalised_ct = self.samples.normalisation.T_ct_normalised.inverse()
        return self.view.T_camera_scene.inverse() @ T_camera_normalised @ T_normalised_ct


def run_default(
    organ: Organ,
    scene: Scene,
    landmarks: Array,
    camera: Camera,
    unit: SceneUnit | None,
    options: RegisterOptions,
    progress: Progress,
) -> MethodResult:
    """Registration by the default method; landmarks (L, 3) in RAS mm, L may be 0."""
    seed, marks = options.seed, [perf_counter()]
    progress("coarse", 0.0)
    samples = sample_surface(organ, seed=seed)
    view = splat_view(scene.centres, scene.others, camera, seed=seed)
    prior, expected = LandmarkPrior.of(landmarks, samples), unit_scale(unit, samples)
    starts, free_start = _search(samples, view, prior, unit, seed, progress)
    marks.append(perf_counter())
    progress("basis", 0.0)
    reduced = reduce_organ(organ, samples, seed=seed)
    marks.append(perf_counter())

    def prior_of_scale(start: Similarity) -> ScalePrior:
        return scale_prior(start, expected, unit)

    poses = starts.modes().poses
    modes = choose_mode(reduced, view, poses, landmarks=prior, scale_prior=prior_of_scale, progress=progress)
    unit_notes = _unit_notices(reduced, view, free_start, unit)
    marks.append(perf_counter())
    elastic_options = ElasticOptions.stiffness(options.stiffness)
    recorder = ElasticRecorder(reduced, view, elastic_options, progress)
    state, report = register_elastically(
        reduced, view, modes.best, scale_prior=prior_of_scale, options=elastic_options, on_step=recorder
    )
    state = state.without_rigid_part(reduced)
    marks.append(perf_counter())
    return _result(
        _Stages(samples, view, starts, reduced, modes, state, report, tuple(recorder.steps)),
        seconds=dict(zip(("coarse", "basis", "rigid", "elastic"), np.diff(marks).tolist(), strict=True)),
        notices=(*view.notices, *unit_notes, *_notices(modes, reduced, prior)),
    )


def _result(found: _Stages, *, seconds: dict[str, float], notices: tuple[Notice, ...]) -> MethodResult:
    start = found.starts.poses.at(0)
    return MethodResult(
        similarities={"coarse": found.T_scene_ct(start), "rigid": found.T_scene_ct(found.modes.best)},
        coarse_view=pose_view(start, found.samples, found.view),
        elastic=ElasticResult(
            T_scene_ct=found.T_scene_ct(found.state.pose),
            normalisation=found.samples.normalisation,
            basis=found.organ.basis,
            z=found.state.z,
            quadrature_points=found.organ.elasticity.points,
            steps=found.steps,
            report=found.report,
        ),
        stops={
            "coarse": SolveReport(Stop.SEARCHED, found.starts.candidates),
            "rigid": SolveReport(Stop.SEARCHED, len(found.modes.scores)),
            "elastic": found.report,
        },
        seconds=seconds,
        notices=notices,
    )


def _search(
    samples: SurfaceSamples,
    view: SplatView,
    prior: LandmarkPrior,
    unit: SceneUnit | None,
    seed: int,
    progress: Progress,
) -> tuple[Starts, Similarity]:
    """Starts that keep to the stated unit if there is one, and the best start of a search without it."""
    free = search_start(samples, view, landmarks=prior, seed=seed, progress=progress)
    expected = unit_scale(unit, samples)
    if unit is None or expected is None:
        return free, free.poses.at(0)
    exact = expected if unit.percent <= NEARLY_EXACT else None
    kept = search_start(
        samples, view, landmarks=prior, scale=exact, scale_range=plausible_scales(expected, unit.percent),
        seed=seed, progress=progress,
    )  # fmt: skip
    return kept, free.poses.at(0)


def _unit_notices(
    organ: ReducedOrgan, view: SplatView, free_start: Similarity, unit: SceneUnit | None
) -> tuple[Notice, ...]:
    """Whether a short elastic fit that does not know the unit contradicts it."""
    if unit is None:
        return ()
    state, _ = register_elastically(organ, view, free_start, options=ElasticOptions(levels=SHORT))
    return unit_notices(state.pose.scale, organ.samples, unit)


def _notices(modes: Modes, organ: ReducedOrgan, landmarks: LandmarkPrior) -> list[Notice]:
    notices = []
    runner_up = modes.runner_up(organ)
    best = modes.scores[0].total
    if runner_up is not None and runner_up[1].total < (1 + AMBIGUOUS) * best:
        notices.append(
            Notice(
                "twist_ambiguous",
                f"Another pose fits almost as well (cost {runner_up[1].total:.2f} against {best:.2f}, no unit): "
                "check the overlay from several sides, or give a landmark.",
            )
        )
    if len(landmarks) == 1:
        radius = ON_SURFACE * organ.samples.normalisation.length
        notices.append(
            Notice(
                "single_landmark",
                f"One landmark only: OrganPhys chose its radius, {radius:.0f} mm; the landmark counts as met within "
                "this distance of the seen surface.",
            )
        )
    return notices
