"""Elastic ICP of the OrganPhys paper (section 3.6), in the normalised CT frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ..align.metrics import trimmed_mean
from ..ground.checks import Array, as_points
from ..ground.frames import Similarity
from ..ground.progress import Progress, no_progress
from ..ground.solve_report import SolveReport, Stop
from .paper_model import PaperElasticOptions, PaperModel
from .paper_objective import PaperObjective, correspondences
from .records import ElasticResult, ElasticStep


def paper_elastic(
    model: PaperModel,
    target: Array,
    *,
    T_scene_ct: Similarity,
    mm_per_unit: float | None = None,
    options: PaperElasticOptions | None = None,
    progress: Progress = no_progress,
    on_step: Callable[[Array], None] = lambda z: None,
) -> ElasticResult:
    """Deform the whole CT surface towards the splat (M, 3; scene units) seen through ``T_scene_ct``, which stays fixed.

    Lengths in the records are mm by ``mm_per_unit`` if given, else by the registered scale. The result keeps every
    outer step, and ``on_step`` sees its Z (4H, 3); the report tells how the last alpha level ended (CONVERGED: largest
    move below the tolerance).
    """
    options = options or PaperElasticOptions()
    target = model.normalisation.apply(T_scene_ct.inverse().apply(as_points(target, "splat points", minimum=4)))
    tree, z = cKDTree(target), np.zeros((model.basis.size, 3))
    to_mm = model.normalisation.length * (1.0 if mm_per_unit is None else T_scene_ct.scale * mm_per_unit)
    total = len(options.alphas) * options.outer_steps
    steps: list[ElasticStep] = []
    report = SolveReport(Stop.STEP_LIMIT, 0)
    for level, alpha in enumerate(options.alphas):
        evaluations = 0
        for outer in range(options.outer_steps):
            progress("elastic", (level * options.outer_steps + outer) / total)
            z, step, move = _outer_step(model, tree, target, z, alpha, to_mm, options)
            steps.append(step)
            on_step(z)
            evaluations += step.evaluations
            if move < options.tolerance:
                break
        stop = Stop.CONVERGED if move < options.tolerance else Stop.STEP_LIMIT
        report = SolveReport(stop, outer + 1, evaluations, move)
    progress("elastic", 1.0)
    points = model.elasticity.points
    return ElasticResult(T_scene_ct, model.normalisation, model.basis, z, points, tuple(steps), report)


def _outer_step(
    model: PaperModel,
    tree: cKDTree,
    target: Array,
    z: Array,
    alpha: float,
    to_mm: float,
    options: PaperElasticOptions,
) -> tuple[Array, ElasticStep, float]:
    """New correspondences and one L-BFGS-B solve: z, its record, and the largest move (normalised)."""
    before = model.surface + model.surface_phi @ z
    matched, weights = correspondences(before, tree, sigma=options.sigma, keep=options.keep)
    objective = PaperObjective.at(alpha, model.elasticity, model.surface_phi, model.surface, matched, weights)
    z, report = objective.minimise(z, steps=options.inner_steps, gradient_tolerance=options.gradient_tolerance)
    after = model.surface + model.surface_phi @ z
    move = float(np.sqrt(((after - before) ** 2).sum(1).max()))
    to_splat, to_ct = tree.query(after)[0], cKDTree(after).query(target)[0]
    determinants = model.elasticity.determinants(z)
    step = ElasticStep(
        alpha=alpha,
        trim30_splat_to_ct_mm=trimmed_mean(to_ct) * to_mm,
        mean_ct_to_splat_mm=float(to_splat.mean()) * to_mm,
        trim30_ct_to_splat_mm=trimmed_mean(to_splat) * to_mm,
        volume_drift_percent=100 * float(np.average(determinants, weights=model.elasticity.weights) - 1),
        min_det_f=float(determinants.min()),
        largest_move_mm=move * to_mm,
        energy=objective(z.ravel())[0],
        evaluations=report.evaluations,
    )
    return z, step, move
