"""Records the default method's outer steps for the curves of the report, and passes progress and cancelling on."""

from __future__ import annotations

import numpy as np

from ..align.splat_view import SplatView
from ..elastic.elastic_registration import ElasticOptions, OuterStep
from ..elastic.records import ElasticStep
from ..elastic.reduced_organ import ReducedOrgan
from ..ground.progress import Progress
from .method_memory import LevelEnd
from .recorded_step import RecordedStep
from .stages import OnSurface


class ElasticRecorder:
    """Callable for ``register_elastically(on_step=...)``; ``steps`` grows with the run, ``ends`` has the state at the
    end of every level by its number in ``options``."""

    def __init__(
        self,
        organ: ReducedOrgan,
        view: SplatView,
        options: ElasticOptions,
        progress: Progress,
        on_surface: OnSurface | None = None,
    ) -> None:
        self.organ, self.view, self.progress, self.on_surface = organ, view, progress, on_surface
        self.rest_ct = organ.samples.normalisation.undo(organ.samples.points)
        self.total = sum(level.steps for level in options.levels)
        self.before = np.cumsum([0, *(level.steps for level in options.levels)])
        self.steps: list[RecordedStep] = []
        self.ends: dict[int, LevelEnd] = {}
        self._first, self._level, self._in_level = 0, 0, 0

    def resume(self, levels_done: int, end: LevelEnd | None) -> None:
        """The run goes on after ``levels_done`` levels of ``options``, which led to ``end``."""
        self._first, self.steps = levels_done, [] if end is None else list(end.steps)

    def __call__(self, step: OuterStep) -> None:
        level = self._first + step.level
        self._in_level = self._in_level + 1 if level == self._level else 1
        self._level = level
        self.progress("elastic", float(self.before[level] + self._in_level) / self.total)
        if self.on_surface is not None:
            surface = step.state.pose.apply(self.organ.points(step.state.z))
            self.on_surface(self.rest_ct, self.view.T_camera_scene.inverse().apply(surface))
        self.steps.append(RecordedStep(step, self.organ, self.view))
        self.ends[level] = LevelEnd(step.state, tuple(self.steps), step.move)

    @property
    def figures(self) -> tuple[ElasticStep, ...]:
        """Of all steps."""
        return tuple(step.figures for step in self.steps)
