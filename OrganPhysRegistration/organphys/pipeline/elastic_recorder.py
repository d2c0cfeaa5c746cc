"""Records the default method's outer steps for the curves of the report, and passes progress and cancelling on."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..align.metrics import trimmed_mean
from ..align.splat_view import SplatView
from ..elastic.elastic_registration import ElasticOptions, OuterStep
from ..elastic.records import ElasticStep
from ..elastic.reduced_organ import ReducedOrgan
from ..ground.progress import Progress
from .method_memory import LevelEnd
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
        self.steps: list[ElasticStep] = []
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
        state, length = step.state, self.organ.samples.normalisation.length
        surface = state.pose.apply(self.organ.points(state.z))
        if self.on_surface is not None:
            self.on_surface(self.rest_ct, self.view.T_camera_scene.inverse().apply(surface))
        to_mm = length / state.pose.scale
        to_ct = cKDTree(surface).query(self.view.surface.samples)[0] * to_mm
        to_splat = self.view.tree.query(surface[:: max(1, len(surface) // 2000)])[0] * to_mm
        determinants = self.organ.elasticity.determinants(state.z)
        self.steps.append(
            ElasticStep(
                alpha=step.alpha,
                trim30_splat_to_ct_mm=trimmed_mean(to_ct),
                mean_ct_to_splat_mm=float(to_splat.mean()),
                trim30_ct_to_splat_mm=trimmed_mean(to_splat),
                volume_drift_percent=100 * float(determinants.mean() - 1),
                min_det_f=float(determinants.min()),
                largest_move_mm=step.move * length,
                energy=self.organ.elasticity.energy(state.z),
                evaluations=step.evaluations,
            )
        )
        self.ends[level] = LevelEnd(state, tuple(self.steps), step.move)
