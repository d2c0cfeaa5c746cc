"""The default method's elastic stage: visible-side data terms, Neo-Hookean prior, joint scale.

Outer loop: correspondences, visibility and normals from the present shape; inner: a few preconditioned steps of the
quadratic-plus-elastic sub-problem. The stiffness alpha and the robust width tau fall level by level.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..align.landmark_prior import LandmarkPrior
from ..align.splat_view import SplatView
from ..ground.checks import Array, one_of
from ..ground.frames import Similarity, fit_similarity
from ..ground.solve_report import SolveReport, Stop
from ..ground.stiffness import PRESET_ALPHA
from ..points.sampling import random_subset
from .data_terms import DataOptions, organ_matches, rim_matches, splat_matches
from .held_tissue import free_tissue
from .joint_scale import ScalePrior, data_quadratic, solve
from .landmark_matches import landmark_matches
from .load_prior import load_hessian
from .matches import Deformed, Matches
from .reduced_organ import ReducedOrgan
from .temporal_prior import TemporalPrior
from .visibility import visibility


@dataclass(frozen=True)
class ElasticLevel:
    """Stiffness weight ``alpha`` of the prior, robust width, most outer steps; ``loads``: share of the load prior in
    it, the rest is the mean elastic energy (Young's modulus 1)."""

    alpha: float
    tau: float
    steps: int
    loads: float = 0.8


SHORT = (ElasticLevel(0.4, 0.15, 5, 0.0), ElasticLevel(0.1, 0.12, 5, 0.0), ElasticLevel(0.04, 0.09, 5, 0.0))
SEEN_TAU = 0.15  # depth gate of the share that is seen: the same whichever levels are still to be run
TOO_LITTLE = 1e-3  # mean robust weight of the matches under which organ and splat do not meet at all


@dataclass(frozen=True)
class ElasticOptions:
    """``move_tolerance`` ends a level: largest move of a sample, normalised; ``organ_points`` tried for visibility;
    ``seen_share``: of the surface, below which the data weigh less by as much as less is seen."""

    levels: tuple[ElasticLevel, ...] = (
        ElasticLevel(0.4, 0.15, 8),
        ElasticLevel(0.1, 0.12, 10),
        ElasticLevel(0.04, 0.12, 14),
        ElasticLevel(PRESET_ALPHA["moderate"], 0.12, 20),
    )
    data: DataOptions = field(default_factory=DataOptions)
    organ_points: int = 2200
    inner_steps: int = 6
    move_tolerance: float = 5e-4
    seen_share: float = 0.27

    @classmethod
    def stiffness(cls, preset: str | float) -> ElasticOptions:
        """Presets name the last alpha: conservative 0.03, moderate 0.009 (default), aggressive 0.003; or a number."""
        if not isinstance(preset, str):
            return cls.down_to(float(preset))
        return cls.down_to(PRESET_ALPHA[one_of(preset, "stiffness", tuple(PRESET_ALPHA))])

    @classmethod
    def short(cls) -> ElasticOptions:
        """A few steps to an elastic energy, by which poses are compared."""
        return cls(levels=SHORT, data=DataOptions(free_only=False), seen_share=0.0)

    @classmethod
    def down_to(cls, last: float) -> ElasticOptions:
        """The levels stiffer than the alpha ``last``, and one of it."""
        levels = tuple(level for level in cls().levels if level.alpha > last)
        return cls(levels=(*levels, replace(cls().levels[-1], alpha=last)))


@dataclass(frozen=True)
class ElasticState:
    """Z (4H, 3), the joint scale gamma and the starting pose T_camera_normalised they refer to."""

    z: Array
    gamma: float
    start: Similarity

    @property
    def pose(self) -> Similarity:
        """T_camera_normalised in force."""
        return Similarity(self.start.scale / self.gamma, self.start.rotation, self.start.translation)

    def deformed(self, organ: ReducedOrgan) -> Deformed:
        return Deformed(organ.points(self.z), organ.normals(self.z), self.gamma, self.start)

    def without_rigid_part(self, organ: ReducedOrgan) -> ElasticState:
        """The same map with the rotation and translation held in Z moved into the pose (gamma becomes 1)."""
        rest = organ.elasticity.points
        motion = fit_similarity(rest, rest + organ.phi_volume @ self.z, scale=False)
        back = motion.inverse()
        z = self.z @ motion.rotation + organ.basis.similarity_coordinates(back.rotation - np.eye(3), back.translation)
        return ElasticState(z, 1.0, self.pose @ motion)


@dataclass(frozen=True)
class OuterStep:
    """What one outer step did: ``move`` in normalised lengths."""

    level: int
    alpha: float
    state: ElasticState
    move: float
    evaluations: int
    matches: int


def register_elastically(
    organ: ReducedOrgan,
    view: SplatView,
    start: Similarity,
    *,
    scale_prior: Callable[[Similarity], ScalePrior] = lambda start: ScalePrior(),
    options: ElasticOptions | None = None,
    on_step: Callable[[OuterStep], None] = lambda step: None,
    resume: ElasticState | None = None,
    prior_on_z: TemporalPrior | None = None,
    landmarks: LandmarkPrior | None = None,
) -> tuple[ElasticState, SolveReport]:
    """Elastic registration from the pose ``start`` = T_camera_normalised; det F > 0 at every quadrature point.

    ``on_step`` sees every outer step; an exception it raises (Cancelled) ends the run. ``resume``: a state to go on
    from instead of the undeformed organ at ``start``; ``prior_on_z``: holds Z near an earlier one; ``landmarks``: those
    with a place in the splat pull there. Every level begins with the rigid part of the deformation moved into the pose,
    since the load prior holds for small rotations.
    """
    options = options or ElasticOptions()
    chosen = random_subset(len(organ.samples.points), options.organ_points, 0)
    state = resume or ElasticState(np.zeros((organ.basis.size, 3)), 1.0, start)
    stiffer = _stiffer(organ, view, start, options)
    count, move, evaluations = 0, np.inf, 0
    with ThreadPoolExecutor(1) as beside:  # the load prior needs the state alone, the data the matches
        for number, level in enumerate(options.levels):
            state = state.without_rigid_part(organ) if state.z.any() else state
            alpha = stiffer * level.alpha
            prior = scale_prior(state.start)
            for _ in range(level.steps):
                load = beside.submit(load_hessian, organ, state.z) if level.loads else None
                shape = state.deformed(organ)
                matches = find_matches(organ, shape, view, chosen, level.tau, options.data, landmarks)
                if matches.weights.sum() < TOO_LITTLE:
                    return state, SolveReport(Stop.NO_DATA, count, evaluations, move)
                data = data_quadratic(organ, matches, shape.points, state.gamma, prior)
                data = data if prior_on_z is None else prior_on_z.added_to(data)
                z, gamma, spent = solve(
                    organ, data, alpha, level.loads, state.z, state.gamma,
                    steps=options.inner_steps, load=None if load is None else load.result(),
                )  # fmt: skip
                move = float(np.abs(organ.phi @ (z - state.z)).max()) + abs(gamma - state.gamma)
                state, count, evaluations = ElasticState(z, gamma, state.start), count + 1, evaluations + spent
                on_step(OuterStep(number, alpha, state, move, spent, len(matches.rows)))
                if move < options.move_tolerance:
                    break
    stop = Stop.CONVERGED if move < options.move_tolerance else Stop.STEP_LIMIT
    return state, SolveReport(stop, count, evaluations, move)


def _stiffer(organ: ReducedOrgan, view: SplatView, start: Similarity, options: ElasticOptions) -> float:
    """Factor of alpha, 1 or more. The data are means over what is seen, the prior is one over the whole organ: they
    keep their proportion per area when the data weigh by the share that is seen."""
    shape = Deformed(organ.samples.points, organ.samples.normals, 1.0, start)
    seen = float(visibility(shape, view, SEEN_TAU).front.mean())
    return max(1.0, options.seen_share / max(seen, 0.01))


def find_matches(
    organ: ReducedOrgan,
    shape: Deformed,
    view: SplatView,
    chosen: NDArray[np.int64],
    tau: float,
    options: DataOptions,
    landmarks: LandmarkPrior | None = None,
) -> Matches:
    """All data terms of one outer step."""
    seen = visibility(shape, view, tau)
    of_splat, free = splat_matches(shape, view, tau, options), None
    if options.free_only:
        free = free_tissue(shape, view, of_splat, tau)
        of_splat = replace(of_splat, weights=free * of_splat.weights)
    return Matches.join(
        [
            of_splat,
            organ_matches(shape, view, seen, chosen, tau, options, free),
            rim_matches(shape, view, seen, organ.samples.spacing, tau, options),
            landmark_matches(organ.samples, shape, landmarks),
        ]
    )
