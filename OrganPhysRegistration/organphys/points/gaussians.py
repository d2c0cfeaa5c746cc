"""The full record of a splat: every number of every Gaussian, for writing it again after it was moved."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

SH_C0 = 0.28209479177387814  # zero-order spherical harmonic, 1 / (2 sqrt(pi))
LOGIT_LIMIT = 40.0  # stands for opacity exactly 0 or 1

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Gaussians:
    """All Gaussians of a splat in file order, raw scene units, in the file's own parametrisation.

    means (N, 3); log_scales (N, 3), natural log of scene units, (N, 2) for 2D Gaussians, (N, 0) for plain points;
    quaternions (N, 4) w, x, y, z, not normalised, or (N, 0); opacity_logits (N,); sh_dc (N, 3); sh_rest (N, 3, K) per
    colour channel, K = 0, 3, 8, 15 or 24; extra: further fields by name (N,), in their own type; valid (N,) bool.
    """

    means: Floats
    log_scales: Floats
    quaternions: Floats
    opacity_logits: Floats
    sh_dc: Floats
    sh_rest: Floats
    valid: NDArray[np.bool_]
    extra: dict[str, NDArray[np.generic]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.means)

    @property
    def sh_degree(self) -> int:
        return round((self.sh_rest.shape[2] + 1) ** 0.5) - 1


def colour_from_sh(sh_dc: Floats) -> Floats:
    """Colours (N, 3) in 0..1 of zero-order coefficients (N, 3), as the 3DGS renderer shows them head on."""
    colours: Floats = np.clip(0.5 + SH_C0 * sh_dc, 0, 1)
    return colours


def logit_from_opacity(opacities: Floats) -> Floats:
    """Logits (N,) of opacities (N,) in 0..1, finite also for 0 and 1."""
    with np.errstate(divide="ignore"):
        logits: Floats = np.log(opacities) - np.log1p(-opacities)
    return np.clip(logits, -LOGIT_LIMIT, LOGIT_LIMIT)
