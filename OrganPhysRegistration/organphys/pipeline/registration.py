"""What one registration run is asked for and what comes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from ..align.records import CoarseView
from ..asset.registered_organ import RegisteredOrgan
from ..elastic.records import ElasticStep
from ..ground.checks import Array, InputError, as_positive, one_of
from ..ground.frames import Similarity
from ..ground.notices import Notice
from ..ground.solve_report import SolveReport
from ..ground.stiffness import ALPHA_RANGE
from ..points.point_sets import Camera, SceneUnit
from .fit_evidence import FitEvidence
from .verdict import Verdict

METHODS = ("organphys", "paper")
AMBIGUOUS = 0.05  # a second best pose within this fraction of the best cost is told
STIFFNESS = ("conservative", "moderate", "aggressive")


@dataclass(frozen=True)
class RegisterOptions:
    """Method and its settings. ``opacity``: threshold of the splat; ``weights``: skinning weights of the paper method;
    ``clean``: remove outliers and small clusters from the splat first; ``landmark_radius_mm``: radius of the Hann
    weights (paper method), distance within which a landmark counts as met (default method); None: automatic.
    ``stiffness``: one of STIFFNESS; or, default method, a number within ALPHA_RANGE: the weight of the prior
    in the end (moderate is 0.009, larger is stiffer)."""

    method: str = "organphys"
    stiffness: str | float = "moderate"
    seed: int = 0
    opacity: float = 0.1
    weights: str = "rkpm"
    clean: bool = False
    landmark_radius_mm: float | None = None

    def __post_init__(self) -> None:
        one_of(self.method, "method", METHODS)
        self._check_stiffness()
        one_of(self.weights, "skinning weights", ("rkpm", "learned"))
        if self.landmark_radius_mm is not None:
            as_positive(self.landmark_radius_mm, "landmark radius in mm")
        if not 0 <= self.seed < 2**63:
            raise InputError(f"seed: expected a whole number of at least 0, got {self.seed}")

    def _check_stiffness(self) -> None:
        if isinstance(self.stiffness, str) or self.method == "paper":
            one_of(str(self.stiffness), "stiffness", STIFFNESS)
        elif not ALPHA_RANGE[0] <= self.stiffness <= ALPHA_RANGE[1]:
            low, high = ALPHA_RANGE
            raise InputError(f"stiffness: expected a number from {low} to {high}, got {self.stiffness}")


@dataclass(frozen=True)
class Registration:
    """The registered organ and everything the report tells about the run.

    similarities: T_scene_ct per stage ("before", "coarse", "rigid", "elastic"); metrics: {stage: {name: {value,
    unit}}}; target (M, 3): the splat points used, scene units; vertex_distance_mm (Nv,): to them from the registered
    surface vertices; vertex_seen (Nv,) bool: which of those face the camera on the splat; splat_points (K, 3),
    splat_colours (K, 3): a sample of the opaque splat for pictures; runner_up:
    T_scene_ct of the best pose clearly elsewhere; facts: label and text for the report; verdict:
    whether to trust the result, evidence: the fit's own numbers behind it; began: perf_counter() when the run started.
    """

    organ: RegisteredOrgan
    options: RegisterOptions
    similarities: Mapping[str, Similarity]
    coarse_view: CoarseView
    steps: tuple[ElasticStep, ...]
    metrics: Mapping[str, Mapping[str, Mapping[str, float | str]]]
    stops: Mapping[str, SolveReport]
    seconds: Mapping[str, float]
    notices: tuple[Notice, ...]
    target: Array
    vertex_distance_mm: Array
    vertex_seen: NDArray[np.bool_]
    splat_points: NDArray[np.floating]
    splat_colours: NDArray[np.floating]
    camera: Camera
    unit: SceneUnit | None = None
    runner_up: Similarity | None = None
    facts: Mapping[str, str] = field(default_factory=dict)
    verdict: Verdict | None = None
    evidence: FitEvidence | None = None
    began: float = field(default_factory=perf_counter)

    def stage_points(self, stage: str) -> Array:
        """Organ surface vertices (Nv, 3) in the scene after a stage."""
        if stage == "elastic":
            return self.organ.scene_vertices
        return self.similarities[stage].apply(self.organ.vertices)
