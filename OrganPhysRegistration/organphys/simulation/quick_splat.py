"""Many Gaussians that follow a body in real time, by interpolation on a grid: in numpy, or by kernels on CPU or GPU.

Each Gaussian moves by b u and has F = I + b (F_body - I) + u (grad b)^T with the body's motion from the grid; local
functions and the share b are exact. ``splat_binding`` evaluates all of it exactly and is the reference.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..ground.checks import Array, as_positive, one_of
from ..points.gaussians import Gaussians
from .blas_threads import one_blas_thread
from .body import Body
from .gaussian_shapes import covariances
from .simulation_basis import LocalColumns
from .splat_binding import Followers, followers
from .splat_grid import Single, SplatGrid
from .splat_numpy import NumpyMover

SPACING = 0.003  # m
DEVICES = ("numpy", "cpu", "cuda")


class Mover(Protocol):
    """Moves Gaussians at base coordinates (n, 3) and the local functions' coordinates (k, 3), if there are any."""

    def frame(self, base: Array, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and covariances (K, 3, 3)."""

    def motion(self, base: Array, local: LocalColumns | None, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients (K, 3, 3)."""


@dataclass(frozen=True)
class QuickSplat:
    """Followers of a body on a grid; ``frame`` and ``motion`` as those of ``SplatBinding``, up to the grid's error."""

    bound: Followers
    grid: SplatGrid
    exact: NumpyMover
    mover: Mover

    @property
    def index(self) -> NDArray[np.int64]:
        """Rows (K,) of the splat that follow."""
        return self.bound.index

    @property
    def points(self) -> Array:
        """Rest positions (K, 3), m."""
        return self.bound.points

    @property
    def share(self) -> Array:
        """How far each follows (K,), 0 to 1."""
        return self.bound.share

    @property
    def unit(self) -> float:
        """Metres per scene unit."""
        return self.bound.unit

    @one_blas_thread
    def frame(self, body: Body, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and covariances F C F^T (K, 3, 3) at Z (n, 3) of ``body``."""
        return self.mover.frame(*self._coordinates(body, z))

    @one_blas_thread
    def motion(self, body: Body, z: Array) -> tuple[Single, Single]:
        """Displacements (K, 3) in scene units and deformation gradients F (K, 3, 3) at Z (n, 3) of ``body``."""
        return self.mover.motion(*self._coordinates(body, z))

    def _coordinates(self, body: Body, z: Array) -> tuple[Array, LocalColumns | None, Array]:
        n, local = self.grid.phi.shape[1], body.basis.local
        base = z[:n] if local is None else z[:n] - local.overlap @ z[n:]
        return base, local, z[n:]


@one_blas_thread
def quick_splat(
    body: Body,
    gaussians: Gaussians,
    metres_per_unit: float,
    *,
    distance: float = 0.003,
    band: float = 0.003,
    spacing: float = SPACING,
    device: str = "numpy",
) -> QuickSplat:
    """Binds Gaussians as ``bind_splat`` does, for many of them, in the order of the grid's cells, ``spacing`` m wide.

    The grid's error is of second order in the spacing: at the default it is below 0.1 mm, and below 2 % of the
    covariance, for a rough motion that strains a liver by up to 30 % (``Testing/benchmarks/simulation_splats.py``).

    ``device`` "cpu" and "cuda" need warp-lang (extra "gpu"): InputError if it is missing or the device is.
    """
    one_of(device, "device", DEVICES)
    bound = followers(body, gaussians, metres_per_unit, distance, band)
    cells = np.floor(bound.points / as_positive(spacing, "spacing")).astype(np.int64)
    fading = bound.share < 1  # those that follow in full need less work: they come first, by themselves
    order = np.lexsort((*cells.T[::-1], fading))  # neighbours in space lie together in memory
    bound = Followers(bound.index[order], bound.points[order], bound.share[order], bound.share_slope[order], bound.unit)
    grid = SplatGrid.around(bound.points, (body.plain or body).basis, spacing)
    exact = NumpyMover(bound, grid, covariances(gaussians, bound.index).astype(np.float32))
    return on_device(QuickSplat(bound, grid, exact, exact), device)


def on_device(splat: QuickSplat, device: str) -> QuickSplat:
    """The same Gaussians moved by "numpy", or by warp's kernels on "cpu" or "cuda"."""
    if one_of(device, "device", DEVICES) == "numpy":
        return replace(splat, mover=splat.exact)
    from .splat_warp import WarpMover

    return replace(splat, mover=WarpMover(splat.bound, splat.grid, splat.exact.covariance, device))
