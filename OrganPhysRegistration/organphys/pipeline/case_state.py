"""How far a case has come: the records of the stages done and what follows from them. Never changed, only replaced."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..asset.baked_surface import BakedSurface
from ..ground.checks import InputError
from ..ground.frames import Similarity
from ..ground.notices import Notice
from .case import Case
from .finished_case import FinishedCase, finish_case
from .registration import Registration
from .stage_metrics import Metrics, pose_metrics
from .verdict import Verdict, verdict_of


@dataclass(frozen=True)
class CaseState:
    """stages: the records of stages.py by name, in order; metrics: of each; finished: after the elastic stage."""

    case: Case
    stages: Mapping[str, Any] = field(default_factory=dict)
    metrics: Mapping[str, Metrics] = field(default_factory=dict)
    finished: FinishedCase | None = None

    def followed_by(self, stages: Mapping[str, Any], baked: BakedSurface | None = None) -> CaseState:
        """The state with these stages; what is known of those it shares with them is kept. ``baked``: see
        ``finish_case``."""
        metrics, finished = {}, None
        for name, stage in stages.items():
            known = name in self.metrics and self._same(name, stage)
            if name == "elastic":
                finished = self.finished if known and self.finished else finish_case(self.case, stage.result, baked)
                metrics[name] = finished.metrics
            elif known:
                of_choice = getattr(self.stages.get(name), "metrics", {})
                metrics[name] = {key: value for key, value in self.metrics[name].items() if key not in of_choice}
            else:
                metrics[name] = pose_metrics(self.case, stage.T_scene_ct)
            metrics[name] = {**metrics[name], **getattr(stage, "metrics", {})}
        return CaseState(self.case, stages, metrics, finished)

    def changed(self, case: Case) -> CaseState:
        """The same stages of a changed case."""
        same_mm = case.stated_mm == self.case.stated_mm
        return CaseState(case, self.stages, self.metrics if same_mm else {}, self.finished if same_mm else None)

    def _same(self, name: str, stage: Any) -> bool:
        """Whether a stage is the one known, or has its pose, on which the figures of a rigid one depend alone."""
        known = self.stages.get(name)
        if stage is known or known is None or name == "elastic":
            return stage is known
        return np.array_equal(stage.T_scene_ct.matrix, known.T_scene_ct.matrix)

    @property
    def stage(self) -> str:
        """The last stage done; "before" if none is."""
        return ("before", *self.stages)[-1]

    @property
    def similarities(self) -> dict[str, Similarity]:
        """T_scene_ct of the stages done, and "before" them: the CT as it lies in its own axes, put on the splat's
        centroid at the coarse scale."""
        scale, case = self.stages["coarse"].T_scene_ct.scale, self.case
        before = Similarity(scale, np.eye(3), case.scene.target.mean(0) - scale * case.organ.vertices.mean(0))
        return {"before": before, **{name: stage.T_scene_ct for name, stage in self.stages.items()}}

    @property
    def seconds(self) -> dict[str, float]:
        """Of the parts of all stages done, by name."""
        return {name: value for stage in self.stages.values() for name, value in stage.seconds.items()}

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What the user must be told, in the order of the stages."""
        found = [notice for stage in self.stages.values() for notice in stage.notices]
        return (*self.case.notices, *found, *(self.finished.notices if self.finished else ()))

    @property
    def verdict(self) -> Verdict | None:
        """Whether the elastic result may be trusted; None before it."""
        if self.finished is None:
            return None
        evidence, radius_mm = self.stages["elastic"].evidence, self.finished.state.radius_mm
        return verdict_of(evidence, self.finished.metrics, self.notices, radius_mm=radius_mm)

    @property
    def facts(self) -> dict[str, str]:
        """Label and text of the inputs and of the poses set by hand, for the report."""
        by_hand = [name for name in self.stages if getattr(self.stages[name], "by_hand", False)]
        return {**self.case.facts, **{f"start of the {name} stage": "set by hand" for name in by_hand}}

    @property
    def registration(self) -> Registration:
        """Registered organ and all that the report tells; InputError before the elastic stage."""
        case, finished = self.case, self.finished
        if finished is None:
            raise InputError("elastic stage: it has not been run yet; run it first")
        return Registration(
            organ=finished.organ,
            options=case.options,
            similarities=self.similarities,
            coarse_view=self.stages["coarse"].view,
            steps=self.stages["elastic"].result.steps,
            metrics=self.metrics,
            stops={name: stage.report for name, stage in self.stages.items()},
            seconds=self.seconds,
            notices=self.notices,
            target=case.scene.target,
            vertex_distance_mm=finished.state.distance_mm,
            vertex_seen=finished.state.seen(case.camera.position),
            splat_points=case.splat.centres[case.scene.picture],
            splat_colours=case.splat.colours[case.scene.picture],
            camera=case.camera,
            unit=case.unit,
            runner_up=getattr(self.stages.get("rigid"), "runner_up_T", None),
            facts=self.facts,
            verdict=self.verdict,
            evidence=self.stages["elastic"].evidence,
        )
