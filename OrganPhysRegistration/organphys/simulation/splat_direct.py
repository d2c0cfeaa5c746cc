"""Gaussians that follow a body, evaluated anew for every moment: for one moment, or more Gaussians than memory holds.

The same motion as that of ``splat_binding``, which keeps the basis of every Gaussian (some 1.3 kB at 20 handles) to be
quick from the fourth moment on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array
from ..points.gaussians import Gaussians
from .body import Body
from .splat_binding import Followers, Single, followers, local_motion

CHUNK = 1 << 16


@dataclass(frozen=True)
class DirectSplat:
    """``index`` and ``motion`` as those of ``SplatBinding``."""

    bound: Followers

    @property
    def index(self) -> NDArray[np.int64]:
        """Rows (K,) of the splat that follow."""
        return self.bound.index

    def motion(self, body: Body, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients F (K, 3, 3) at Z (n, 3) of ``body``."""
        moved = np.empty((len(self.index), 3), dtype=np.float32)
        f = np.empty((len(self.index), 3, 3), dtype=np.float32)
        for start in range(0, len(self.index), CHUNK):
            part = slice(start, start + CHUNK)
            moved[part], f[part] = self._chunk(body, z, part)
        return moved, f

    def _chunk(self, body: Body, z: Array, part: slice) -> tuple[Array, Array]:
        bound, basis, local = self.bound, (body.plain or body).basis, body.basis.local
        n = basis.size
        base = z[:n] if local is None else z[:n] - local.overlap @ z[n:]
        u, slopes = basis.motion(base, bound.points[part])
        if local is not None:
            near, extra, more = local_motion(local, z[n:], bound.points[part])
            u[near] += extra
            slopes[near] += more
        f = bound.share[part, None, None] * slopes + u[:, :, None] * bound.share_slope[part, None, :]
        f[:, [0, 1, 2], [0, 1, 2]] += 1.0
        return bound.share[part, None] * u / bound.unit, f


def direct_splat(
    body: Body, gaussians: Gaussians, metres_per_unit: float, *, distance: float = 0.003, band: float = 0.003
) -> DirectSplat:
    """Binds Gaussians as ``bind_splat`` does, at once and in little memory."""
    return DirectSplat(followers(body, gaussians, metres_per_unit, distance, band))
