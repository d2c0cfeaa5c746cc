"""The method of the OrganPhys paper: as it is, from the common start, and its Figure 8."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from organphys.elastic.paper_elastic import paper_elastic
from organphys.elastic.paper_model import LEVELS, PaperElasticOptions, paper_model
from organphys.elastic.records import ElasticStep
from organphys.ground.frames import Similarity

from ..problem.outcome import Clock, Outcome
from ..problem.problem import Problem
from .by_stages import outcome, registered_by_stages
from .rigid_icp import similarity_start


def paper(problem: Problem, clock: Clock) -> Outcome:
    """Its own coarse alignment, rigid and elastic ICP (preset moderate)."""
    return _registered(problem, clock, None)


def paper_same_start(problem: Problem, clock: Clock) -> Outcome:
    """Its rigid and elastic ICP from the start that the other peers get."""
    with clock.stage("start"):
        start = problem.start
    return _registered(problem, clock, start)


def _registered(problem: Problem, clock: Clock, start: Similarity | None) -> Outcome:
    done = registered_by_stages(problem, clock, method="paper", start=start)
    return outcome(done, steps=curve(done.steps, done.organ.normalisation.length))


@dataclass(frozen=True)
class OneAlpha(PaperElasticOptions):
    """A single level, with the steps of the paper's Figure 8."""

    outer_steps: int = 35
    inner_steps: int = 300

    @property
    def alphas(self) -> tuple[float, ...]:
        return (LEVELS[self.stiffness][-1],)


def paper_figure_8(problem: Problem, clock: Clock) -> Outcome:
    """The elastic ICP three times, at one alpha each, after a similarity ICP; mapped as with alpha 0.005."""
    T_scene_ct, stages = similarity_start(problem, clock)
    curves: dict[str, Any] = {}
    for preset in LEVELS:
        options = OneAlpha(stiffness=preset, seed=problem.seed)
        with clock.stage("basis"):
            organ = problem.organ
            model = paper_model(organ.boundary_points, organ.volume_points, organ.volume_ml, options=options)
        with clock.stage(f"elastic, alpha {options.alphas[0]}"):
            found = paper_elastic(model, problem.case.scene.target, T_scene_ct=T_scene_ct, options=options)
        curves[str(options.alphas[0])] = curve(found.steps, model.normalisation.length)
    return Outcome(found.map_points, T_scene_ct, stages=stages, facts={"figure_8": curves})


def curve(steps: tuple[ElasticStep, ...], length_mm: float) -> list[list[float]]:
    """Per outer step: alpha, trim30 splat to CT in the paper's unit (CT box), volume drift in percent."""
    return [[s.alpha, s.trim30_splat_to_ct_mm / length_mm, s.volume_drift_percent] for s in steps]
