"""The stages of method="paper"."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

from ..align.paper_coarse import PaperCoarseOptions, paper_coarse
from ..align.paper_rigid import PaperRigidOptions, paper_rigid
from ..align.records import CoarseView
from ..elastic.paper_elastic import paper_elastic
from ..elastic.paper_model import PaperElasticOptions, PaperModel, paper_model
from ..ground.checks import Array, InputError
from ..ground.frames import Similarity
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..ground.solve_report import SolveReport, Stop
from .case import Case
from .registration import AMBIGUOUS
from .stages import CoarseStage, ElasticStage, OnSurface, RigidStage


class PaperMethod:
    """Coarse, weighted rigid ICP, basis and elastic ICP as the paper has them."""

    def __init__(self, case: Case) -> None:
        if not len(case.landmarks):
            raise InputError("method paper needs one or two landmarks: give --landmarks or use the method organphys")
        self.case = case
        self.boundary = case.organ.boundary_points

    def coarse(self, progress: Progress) -> CoarseStage:
        """Scale from two extents, front to viewer, twist search."""
        begin, case = perf_counter(), self.case
        coarse, view = paper_coarse(
            self.boundary, case.scene.target, case.landmarks, case.camera.position,
            options=PaperCoarseOptions(seed=case.options.seed), progress=progress,
        )  # fmt: skip
        return CoarseStage(
            T_scene_ct=coarse,
            view=view,
            report=SolveReport(Stop.SEARCHED, len(view.twists_deg)),
            seconds={"coarse": perf_counter() - begin},
            notices=_twist_notices(view),
        )

    def rigid(self, coarse: CoarseStage, start: Similarity | None, progress: Progress) -> RigidStage:
        """Weighted trimmed ICP from six twists; from a pose set by hand without other twists."""
        begin, case = perf_counter(), self.case
        options = PaperRigidOptions(seed=case.options.seed, radius_mm=case.options.landmark_radius_mm)
        if start is not None:
            options = replace(options, starts=1)
        rigid = paper_rigid(
            self.boundary, case.scene.target, case.landmarks,
            coarse=coarse.T_scene_ct if start is None else start, view=coarse.view, options=options, progress=progress,
        )  # fmt: skip
        return RigidStage(
            T_scene_ct=rigid.T_scene_ct,
            report=rigid.report,
            seconds={"rigid": perf_counter() - begin},
            notices=_radius_notices(rigid.radius_mm) if rigid.single_landmark else (),
            by_hand=start is not None,
        )

    def elastic(
        self,
        coarse: CoarseStage,
        rigid: RigidStage,
        start: Similarity | None,
        progress: Progress,
        on_surface: OnSurface | None = None,
    ) -> ElasticStage:
        """Basis and elastic ICP; the pose stays fixed."""
        begin, unit = perf_counter(), self.case.unit
        model = self._model(progress)
        ready, T_scene_ct = perf_counter(), rigid.T_scene_ct if start is None else start
        rest = model.normalisation.undo(model.surface)

        def on_step(z: Array) -> None:
            if on_surface is not None:
                on_surface(rest, T_scene_ct.apply(model.normalisation.undo(model.surface + model.surface_phi @ z)))

        result = paper_elastic(
            model,
            self.case.scene.target,
            T_scene_ct=T_scene_ct,
            mm_per_unit=unit.mm_per_unit if unit and not unit.percent else None,
            options=self._elastic_options,
            progress=progress,
            on_step=on_step,
        )
        seconds = {"basis": ready - begin, "elastic": perf_counter() - ready}
        return ElasticStage(result=result, seconds=seconds, by_hand=start is not None)

    @property
    def _elastic_options(self) -> PaperElasticOptions:
        options = self.case.options
        return PaperElasticOptions(stiffness=str(options.stiffness), weights=options.weights, seed=options.seed)

    def _model(self, progress: Progress) -> PaperModel:
        organ = self.case.organ
        return paper_model(
            self.boundary, organ.volume_points, organ.volume_ml, options=self._elastic_options, progress=progress
        )


def _twist_notices(view: CoarseView) -> tuple[Notice, ...]:
    if view.margin >= AMBIGUOUS:
        return ()
    return (
        Notice(
            "twist_ambiguous",
            f"The second best twist is only {100 * view.margin:.1f} % worse than the chosen one "
            f"({view.chosen_twist_deg:.0f} degrees): check the pose, or give another landmark.",
        ),
    )


def _radius_notices(radius_mm: float) -> tuple[Notice, ...]:
    return (
        Notice(
            "single_landmark",
            f"One landmark only: OrganPhys chose the region radius, {radius_mm:.0f} mm "
            "(half of the organ's projected diameter).",
        ),
    )
