"""Several bodies that touch each other as one minimisation: their potentials and the pairs between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from ..ground.checks import Array
from .body_contact import BodyPairs, PairValue
from .factor import FactorCache, cholesky
from .incremental_potential import Evaluation, IncrementalPotential
from .options import SimulationOptions
from .strain_energy import Tangent


class JointEvaluation(NamedTuple):
    """Energy in J and gradient (n, 3) in N at the coordinates Z (n, 3) of all bodies; ``largest`` force in N."""

    z: Array
    energy: float
    gradient: Array
    largest: float
    parts: tuple[Evaluation, ...]
    pairs: PairValue


@dataclass(frozen=True)
class JointPotential:
    """Potentials of the bodies, whose coordinates follow each other in Z, and what they do to each other."""

    parts: tuple[IncrementalPotential, ...]
    pairs: BodyPairs

    @property
    def options(self) -> SimulationOptions:
        return self.parts[0].options

    @property
    def mass(self) -> float:
        """Mass of the lightest body, kg."""
        return min(part.mass for part in self.parts)

    @property
    def rounding(self) -> float:
        return sum(part.rounding for part in self.parts)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Rows of each body in Z."""
        ends = np.cumsum([0, *(part.body.basis.size for part in self.parts)]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    def evaluate(self, z: Array) -> JointEvaluation:
        """Energy and gradient at Z (n, 3)."""
        parts = tuple(part.evaluate(z[rows]) for part, rows in zip(self.parts, self.slices, strict=True))
        pairs = self.pairs.value(z)
        energy = sum(part.energy for part in parts) + pairs.energy
        gradient = np.concatenate([part.gradient for part in parts]) + pairs.gradient
        largest = max([float(np.linalg.norm(pairs.gradient)), *(part.largest for part in parts)])
        return JointEvaluation(z, energy, gradient, largest, parts, pairs)

    def tangent(self, at: JointEvaluation) -> tuple[list[tuple[Tangent, Array | None]], Array]:
        """What ``product`` needs."""
        return [part.tangent(one) for part, one in zip(self.parts, at.parts, strict=True)], at.pairs.curvature

    def firmer(self, at: JointEvaluation, change: Array) -> JointEvaluation | None:
        """``at`` with friction that ``change`` (n, 3) would turn round taken as sticking; None: there is none."""
        own = zip(self.parts, at.parts, self.slices, strict=True)
        found = [part.firmer(one, change[rows]) for part, one, rows in own]
        if not any(found):
            return None
        parts = tuple(one if new is None else new for one, new in zip(at.parts, found, strict=True))
        return at._replace(parts=parts)

    def product(self, tangent: tuple[list[tuple[Tangent, Array | None]], Array], change: Array) -> Array:
        """Hessian at the tangent's point times ``change`` (n, 3)."""
        own = zip(self.parts, tangent[0], self.slices, strict=True)
        out = np.concatenate([part.product(one, change[rows]) for part, one, rows in own])
        return out + self.pairs.product(tangent[1], change)

    def admissible(self, z: Array) -> bool:
        """Whether no tissue has gone through a tool on the way to Z (n, 3)."""
        return all(part.admissible(z[rows]) for part, rows in zip(self.parts, self.slices, strict=True))


@dataclass(frozen=True)
class JointFactor:
    """Cholesky factor (3n, 3n) of the Hessian with each body turned back by its rotation (3, 3)."""

    lower: Array
    turns: tuple[tuple[slice, Array], ...]

    def solve(self, residual: Array) -> Array:
        """Approximate inverse Hessian times residual (n, 3)."""
        own = np.concatenate([residual[rows] @ turn for rows, turn in self.turns])
        solved = lapack.dpotrs(self.lower, own.ravel(), lower=1)[0].reshape(-1, 3)
        return np.concatenate([solved[rows] @ turn.T for rows, turn in self.turns])


@dataclass(frozen=True)
class JointFactors:
    """Preconditioners of joint potentials from those of the bodies, with stiffness at ``references`` (n, 3) of each."""

    cache: FactorCache
    references: tuple[Array, ...]

    def factor(self, potential: JointPotential, at: JointEvaluation, reference: Array) -> JointFactor:
        """Preconditioner at ``at``; ``reference`` is not used, the bodies have their own."""
        size = 3 * len(at.z)
        matrix, turned, turns = np.zeros((size, size)), np.zeros((len(at.pairs.curvature), size // 3, 3)), []
        own = zip(potential.parts, at.parts, self.references, potential.slices, strict=True)
        for part, one, start, rows in own:
            block, turn = self.cache.matrix(part, one, start)
            where = slice(3 * rows.start, 3 * rows.stop)
            matrix[where, where] = block
            turned[:, rows] = potential.pairs.phi[:, rows, None] * (potential.pairs.normal @ turn)[:, None, :]
            turns.append((rows, turn))
        active = np.flatnonzero(at.pairs.curvature > 0)
        stacked = turned[active].reshape(len(active), size)
        matrix += stacked.T @ (at.pairs.curvature[active, None] * stacked)
        return JointFactor(cholesky(matrix), tuple(turns))
