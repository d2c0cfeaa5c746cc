"""One outer step of the default method's elastic stage, with its figures for the curves of the report."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from scipy.spatial import cKDTree

from ..align.metrics import trimmed_mean
from ..align.splat_view import SplatView
from ..elastic.elastic_registration import OuterStep
from ..elastic.records import ElasticStep
from ..elastic.reduced_organ import ReducedOrgan


@dataclass(frozen=True)
class RecordedStep:
    """What the solver told of a step. ``figures`` cost a quarter of the step and are computed when they are asked for:
    a live update, which shows none, does without."""

    step: OuterStep
    organ: ReducedOrgan
    view: SplatView

    @cached_property
    def figures(self) -> ElasticStep:
        step, state, organ, view = self.step, self.step.state, self.organ, self.view
        length = organ.samples.normalisation.length
        surface, to_mm = state.pose.apply(organ.points(state.z)), length / state.pose.scale
        to_ct = cKDTree(surface).query(view.surface.samples)[0] * to_mm
        to_splat = view.tree.query(surface[:: max(1, len(surface) // 2000)])[0] * to_mm
        determinants = organ.elasticity.determinants(state.z)
        return ElasticStep(
            alpha=step.alpha,
            trim30_splat_to_ct_mm=trimmed_mean(to_ct),
            mean_ct_to_splat_mm=float(to_splat.mean()),
            trim30_ct_to_splat_mm=trimmed_mean(to_splat),
            volume_drift_percent=100 * float(determinants.mean() - 1),
            min_det_f=float(determinants.min()),
            largest_move_mm=step.move * length,
            energy=organ.elasticity.energy(state.z),
            evaluations=step.evaluations,
        )
