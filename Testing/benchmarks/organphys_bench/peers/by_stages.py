"""A method of OrganPhys's pipeline run stage by stage, each with its own seconds."""

from __future__ import annotations

from typing import Any

from organphys.ground.frames import Similarity
from organphys.pipeline.registration import Registration
from organphys.pipeline.session import RegistrationSession
from organphys.pipeline.stages import STAGES

from ..problem.outcome import Clock, Outcome
from ..problem.problem import Problem


def registered_by_stages(
    problem: Problem, clock: Clock, *, method: str = "organphys", start: Similarity | None = None
) -> Registration:
    """What ``register`` does with default settings; ``start``: T_scene_ct for the rigid stage instead of its own."""
    with clock.stage("preparation"):
        session = RegistrationSession(
            problem.organ, problem.splat, problem.options(method=method), landmarks=problem.landmarks,
            camera=problem.camera, box=problem.box,
        )  # fmt: skip
    for stage in STAGES:
        with clock.stage(stage):
            session.advance(stage, start=start if stage == "rigid" else None)
    with clock.stage("figures"):
        return session.registration


def outcome(done: Registration, **facts: Any) -> Outcome:
    """The registration as every method hands it back."""
    stages = {name: done.similarities[name] for name in ("coarse", "rigid")}
    facts |= {"stages_wall_s": dict(done.seconds), "elastic_steps": len(done.steps)}
    return Outcome(done.organ.map_points, done.organ.T_scene_ct, stages=stages, facts=facts)
