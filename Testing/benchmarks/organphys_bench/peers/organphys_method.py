"""OrganPhys itself: the default method, with the landmarks and without."""

from __future__ import annotations

from dataclasses import replace

from ..problem.outcome import Clock, Outcome
from ..problem.problem import Problem
from .by_stages import outcome, registered_by_stages


def organphys(problem: Problem, clock: Clock) -> Outcome:
    """The default method with default settings."""
    done = registered_by_stages(problem, clock)
    return outcome(done, **({} if done.verdict is None else {"verdict": done.verdict.level}))


def organphys_no_landmarks(problem: Problem, clock: Clock) -> Outcome:
    """The default method without any landmark."""
    return organphys(replace(problem, landmarks=None), clock)
