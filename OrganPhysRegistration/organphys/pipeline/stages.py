"""What the stages of a registration hand on; the same for every method."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from ..align.records import CoarseView
from ..elastic.records import ElasticResult
from ..ground.checks import Array
from ..ground.frames import Similarity
from ..ground.notices import Notice
from ..ground.progress import Progress
from ..ground.solve_report import SolveReport
from .fit_evidence import FitEvidence

STAGES = ("coarse", "rigid", "elastic")

OnSurface = Callable[[Array, Array], None]
"""Told in every elastic step: where the solver's surface samples (S, 3; CT mm) lie now (S, 3; scene units)."""


@dataclass(frozen=True, kw_only=True)
class CoarseStage:
    """T_scene_ct after the global search, and how it was found; ``seconds``: by name of the part."""

    T_scene_ct: Similarity
    view: CoarseView
    report: SolveReport
    seconds: Mapping[str, float]
    notices: tuple[Notice, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RigidStage:
    """T_scene_ct after the rigid fit; ``by_hand``: it began at a pose that the user set; metrics: {name: {"value",
    "unit"}} of the choice between poses; runner_up_T: T_scene_ct of the best pose clearly elsewhere."""

    T_scene_ct: Similarity
    report: SolveReport
    seconds: Mapping[str, float] = field(default_factory=dict)
    notices: tuple[Notice, ...] = ()
    by_hand: bool = False
    metrics: Mapping[str, Mapping[str, float | str]] = field(default_factory=dict)
    runner_up_T: Similarity | None = None


@dataclass(frozen=True, kw_only=True)
class ElasticStage:
    """The deformation; ``by_hand``: it began at a pose that the user set, ``start`` = T_scene_ct; ``evidence``: of
    methods that measure how well it fits."""

    result: ElasticResult
    seconds: Mapping[str, float]
    notices: tuple[Notice, ...] = ()
    by_hand: bool = False
    start: Similarity | None = None
    evidence: FitEvidence | None = None

    @property
    def T_scene_ct(self) -> Similarity:
        return self.result.T_scene_ct

    @property
    def report(self) -> SolveReport:
        return self.result.report


class Method(Protocol):
    """A way to register a case. The stages it gets are those it made itself."""

    def coarse(self, progress: Progress) -> Any:
        """A CoarseStage, or one with more in it."""

    def rigid(self, coarse: Any, start: Similarity | None, progress: Progress) -> Any:
        """A RigidStage from the coarse one, or near ``start`` = T_scene_ct set by hand."""

    def elastic(
        self, coarse: Any, rigid: Any, start: Similarity | None, progress: Progress, on_surface: OnSurface | None
    ) -> ElasticStage:
        """From the rigid stage, or from ``start`` = T_scene_ct as it is."""
