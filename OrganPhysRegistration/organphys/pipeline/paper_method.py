"""The stages of method="paper"."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from ..align.paper_coarse import PaperCoarseOptions, paper_coarse
from ..align.paper_rigid import PaperRigidOptions, PaperRigidResult, paper_rigid
from ..align.records import CoarseView
from ..elastic.paper_elastic import paper_elastic
from ..elastic.paper_model import PaperElasticOptions, paper_model
from ..ground.checks import Array, InputError
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..ground.solve_report import SolveReport, Stop
from ..points.point_sets import Camera, Organ, SceneUnit
from .registration import AMBIGUOUS, MethodResult, RegisterOptions
from .scene import Scene


def run_paper(
    organ: Organ,
    scene: Scene,
    landmarks: Array,
    camera: Camera,
    unit: SceneUnit | None,
    options: RegisterOptions,
    progress: Progress,
) -> MethodResult:
    """Coarse, weighted rigid ICP, basis and elastic ICP as the paper has them."""
    if not len(landmarks):
        raise InputError("method paper needs one or two landmarks: give --landmarks or use the method organphys")
    boundary, seed, marks = organ.boundary_points, options.seed, [perf_counter()]
    coarse, view = paper_coarse(
        boundary, scene.target, landmarks, camera.position, options=PaperCoarseOptions(seed=seed), progress=progress
    )
    marks.append(perf_counter())
    rigid = paper_rigid(
        boundary, scene.target, landmarks, coarse=coarse, view=view, options=PaperRigidOptions(seed=seed),
        progress=progress,
    )  # fmt: skip
    marks.append(perf_counter())
    elastic_options = PaperElasticOptions(stiffness=options.stiffness, weights=options.weights, seed=seed)
    model = paper_model(boundary, organ.volume_points, organ.volume_ml, options=elastic_options, progress=progress)
    marks.append(perf_counter())
    elastic = paper_elastic(
        model,
        scene.target,
        T_scene_ct=rigid.T_scene_ct,
        mm_per_unit=unit.mm_per_unit if unit and not unit.percent else None,
        options=elastic_options,
        progress=progress,
    )
    marks.append(perf_counter())
    return MethodResult(
        similarities={"coarse": coarse, "rigid": rigid.T_scene_ct},
        coarse_view=view,
        elastic=elastic,
        stops={
            "coarse": SolveReport(Stop.SEARCHED, len(view.twists_deg)),
            "rigid": rigid.report,
            "elastic": elastic.report,
        },
        seconds=dict(zip(("coarse", "rigid", "basis", "elastic"), np.diff(marks).tolist(), strict=True)),
        notices=_notices(view, rigid),
    )


def _notices(view: CoarseView, rigid: PaperRigidResult) -> tuple[Notice, ...]:
    notices = []
    if view.margin < AMBIGUOUS:
        notices.append(
            Notice(
                "twist_ambiguous",
                f"The second best twist is only {100 * view.margin:.1f} % worse than the chosen one "
                f"({view.chosen_twist_deg:.0f} degrees): check the pose, or give another landmark.",
            )
        )
    if rigid.single_landmark:
        notices.append(
            Notice(
                "single_landmark",
                f"One landmark only: OrganPhys chose the region radius, {rigid.radius_mm:.0f} mm "
                "(half of the organ's projected diameter).",
            )
        )
    return tuple(notices)
