"""The tissue of a simulated body: Neo-Hookean, and stiffer where it is crushed.

A Neo-Hookean volume term of (J - 1)^2 gives way under a thin tool until next to nothing of a volume is left, which no
tissue does: three quarters of it are water. Below ``CRUSHED`` of the rest volume a log barrier in J is added, twice
continuously differentiable and zero above, so that all that is gentler, small strains above all, stays as it was.
"""

from __future__ import annotations

import numpy as np

from ..ground.checks import Array
from ..mechanics.neo_hookean import LogNeoHookean
from ..mechanics.tissue import Tissue
from .barrier import barrier

CRUSHED, STIFFER = 0.45, 3.0


class CrushedNeoHookean(LogNeoHookean):
    """``LogNeoHookean`` plus a barrier in J = det F below ``CRUSHED``, its pressure ``STIFFER`` bulk moduli."""

    def volumetric(self, volume_ratio: Array) -> tuple[Array, Array, Array]:
        terms = super().volumetric(volume_ratio)
        rows = np.flatnonzero(volume_ratio < CRUSHED)
        if len(rows):
            more = barrier(volume_ratio[rows], CRUSHED, STIFFER * (self.lam + 2 / 3 * self.mu))
            for term, part in zip(terms, more, strict=True):
                term[rows] += part
        return terms


def simulated_material(tissue: Tissue) -> CrushedNeoHookean:
    """The material of a body of this tissue."""
    return CrushedNeoHookean.from_youngs(tissue.youngs_pa, tissue.nu)
