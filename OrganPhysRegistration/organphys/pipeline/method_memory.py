"""What the default method remembers between runs on the same organ and splat, so that a small change costs little.

Everything is found again by what it depends on, so a remembered part is exactly what it would be if it were computed
again: short elastic fits by their starting pose, and states at the end of every elastic level by pose and levels.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..elastic.elastic_registration import ElasticLevel, ElasticState
from ..ground.frames import Similarity
from ..ground.solve_report import SolveReport, Stop
from .recorded_step import RecordedStep

Levels = tuple[ElasticLevel, ...]
MOST = 64  # states kept; the oldest go first


@dataclass(frozen=True)
class LevelEnd:
    """State at the end of a level, the steps taken until then, all levels together, and the last one's move."""

    state: ElasticState
    steps: tuple[RecordedStep, ...]
    move: float

    def report(self, tolerance: float) -> SolveReport:
        """Why the solver stopped here, as if all steps had been taken in one go."""
        stop = Stop.CONVERGED if self.move < tolerance else Stop.STEP_LIMIT
        return SolveReport(stop, len(self.steps), sum(one.step.evaluations for one in self.steps), self.move)


@dataclass
class MethodMemory:
    """By the key of a pose: ``short_fits``, short elastic solve; ``level_ends`` (and by the levels done); ``mirrored``,
    score of the organ's mirror image."""

    short_fits: dict[bytes, ElasticState] = field(default_factory=dict)
    level_ends: dict[tuple[bytes, Levels], LevelEnd] = field(default_factory=dict)
    mirrored: dict[bytes, float] = field(default_factory=dict)

    def keep(self, pose: Similarity, levels: Levels, end: LevelEnd) -> None:
        """Remember where ``levels`` led from ``pose``."""
        self.level_ends[pose.key, levels] = end
        while len(self.level_ends) > MOST:
            self.level_ends.pop(next(iter(self.level_ends)))

    def longest(self, pose: Similarity, levels: Levels) -> tuple[int, LevelEnd | None]:
        """How many of ``levels`` need not be run again from ``pose``, and where they lead."""
        for count in range(len(levels), 0, -1):
            end = self.level_ends.get((pose.key, levels[:count]))
            if end is not None:
                return count, end
        return 0, None
