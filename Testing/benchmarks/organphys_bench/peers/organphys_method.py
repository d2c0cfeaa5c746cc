"""OrganPhys itself: the default method, with the landmarks and without."""

from __future__ import annotations

from dataclasses import replace

from organphys.pipeline.register import register

from ..problem.outcome import Clock, Outcome
from ..problem.problem import Problem


def organphys(problem: Problem, clock: Clock) -> Outcome:
    """The default method with default settings."""
    with clock.stage("registration"):
        done = register(
            problem.organ, problem.splat, problem.options(), landmarks=problem.landmarks, camera=problem.camera,
            box=problem.box,
        )  # fmt: skip
    facts = {"stages_wall_s": dict(done.seconds), "elastic_steps": len(done.steps)}
    if done.verdict is not None:
        facts["verdict"] = done.verdict.level
    stages = {name: done.similarities[name] for name in ("coarse", "rigid")}
    return Outcome(done.organ.map_points, done.organ.T_scene_ct, stages=stages, facts=facts)


def organphys_no_landmarks(problem: Problem, clock: Clock) -> Outcome:
    """The default method without any landmark."""
    return organphys(replace(problem, landmarks=None), clock)
