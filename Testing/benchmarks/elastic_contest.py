"""One sub-problem of the paper's elastic stage solved by its L-BFGS-B and by the second-order solver: time and energy.

Both minimise alpha E_NH(z) + sum_i w_i |x_i(z) - u_i|^2 over the same deformations from rest, with the correspondences
of the paper's rigid pose: L-BFGS-B over the paper's coordinates, 80 iterations; L-BFGS preconditioned with the
factor of the Hessian at rest over whitened ones, until the predicted decrease is below a millionth of the energy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg
from scipy.spatial import cKDTree

from organphys.align.paper_coarse import paper_coarse
from organphys.align.paper_rigid import paper_rigid
from organphys.elastic.paper_model import PaperElasticOptions, paper_model
from organphys.elastic.paper_objective import PaperObjective, correspondences
from organphys.ground.solve_report import SolveReport
from organphys.mechanics.lbfgs import minimise
from organphys.pipeline.case import Case

ALPHA, STEPS, TOLERANCE = 0.05, 80, 1e-6
NAMES = ("elastic sub-problem, L-BFGS-B (paper)", "elastic sub-problem, second order")


def same_sub_problem(case: Case) -> tuple[dict[str, Callable[[], object]], tuple[str, ...]]:
    """The two solves by name, and what energies they reach in how many evaluations."""
    plain, whitened = objective(case, whiten=False), objective(case, whiten=True)
    size = len(plain.quadratic)
    solves = {
        NAMES[0]: lambda: plain.minimise(np.zeros((size, 3)), steps=STEPS, gradient_tolerance=1e-8),
        NAMES[1]: lambda: second_order(whitened),
    }
    start, reached = plain(np.zeros(3 * size))[0], []
    for (name, solve), what in zip(solves.items(), (plain, whitened), strict=True):
        z, report = solve()
        reached.append(f"{name}: energy {what(z.ravel())[0]:.5g} from {start:.5g}, {report.evaluations} evaluations")
    return solves, tuple(reached)


def objective(case: Case, *, whiten: bool) -> PaperObjective:
    """The first sub-problem after the paper's rigid stage."""
    organ, target, marks = case.organ, case.scene.target, case.landmarks
    coarse, view = paper_coarse(organ.boundary_points, target, marks, case.camera.position)
    rigid = paper_rigid(organ.boundary_points, target, marks, coarse=coarse, view=view).T_scene_ct
    options = replace(PaperElasticOptions(), whiten=whiten)
    model = paper_model(organ.boundary_points, organ.volume_points, organ.volume_ml, options=options)
    tree = cKDTree(model.normalisation.apply(rigid.inverse().apply(target)))
    matched, weights = correspondences(model.surface, tree, sigma=options.sigma, keep=options.keep)
    return PaperObjective.at(ALPHA, model.elasticity, model.surface_phi, model.surface, matched, weights)


def second_order(problem: PaperObjective) -> tuple[np.ndarray, SolveReport]:
    """Z (4H, 3) by L-BFGS preconditioned with the Hessian at rest, the factor included."""
    hessian = ALPHA * problem.elasticity.rest_hessian() + np.kron(2 * problem.quadratic, np.eye(3))
    factor = scipy.linalg.cho_factor(hessian, lower=True, check_finite=False)
    start = np.zeros(len(hessian))
    z, report = minimise(
        problem,
        start,
        precondition=lambda gradient: scipy.linalg.cho_solve(factor, gradient, check_finite=False),
        steps=STEPS,
        tolerance=TOLERANCE * problem(start)[0],
    )
    return z.reshape(-1, 3), report
