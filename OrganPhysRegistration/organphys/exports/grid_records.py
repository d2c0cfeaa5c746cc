"""The records of displacement grids; they load nothing but numpy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array


@dataclass(frozen=True)
class DisplacementGrid:
    """Vectors (K, J, I, 3) in mm at the points origin + (i, j, k) * spacing, axes along RAS; x-fastest when ravelled.

    origin (3,) RAS mm, spacing (3,) mm. error_mm: "max" and "p95" of what cubic interpolation, VTK's and so Slicer's,
    misses, measured inside the organ at points that are no nodes; error_outside_mm: the same within 30 mm round the
    organ; linear_error_mm: inside, with the trilinear interpolation of other programs.
    """

    origin: Array
    spacing: Array
    vectors: NDArray[np.float32]
    error_mm: Mapping[str, float] = field(default_factory=dict)
    error_outside_mm: Mapping[str, float] = field(default_factory=dict)
    linear_error_mm: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class DisplacementGrids:
    """forward: map_points(x) = T_scene_ct(x + d(x)); inverse: x = q + e(q) with q = T_scene_ct^-1(y)."""

    forward: DisplacementGrid
    inverse: DisplacementGrid
