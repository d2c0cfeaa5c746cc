"""Frames of a moving splat as INRIA PLY files with stable rows: Gaussian i of the input is row i of every frame."""

from __future__ import annotations

import os
from pathlib import Path

from ..points.gaussians import Gaussians
from ..simulation.body import Body
from ..simulation.moved_splat import moved_splat
from ..simulation.quick_splat import QuickSplat, quick_splat
from ..simulation.session import Snapshot
from ..simulation.splat_binding import SplatBinding, bind_splat
from ..simulation.splat_direct import DirectSplat, direct_splat
from .gaussian_ply import write_gaussians

Follower = SplatBinding | QuickSplat | DirectSplat


class FollowingSplat:
    """A splat that follows body number ``index`` of a scene, and is bound again when new pins give it a new basis.

    Exactly by default, and with ``once``, the quick way for a single moment, too. With ``device`` "cpu" or "cuda" by
    warp's kernels there, which interpolate the body's motion on a grid: below 0.1 mm and 2 % of a covariance beside
    the exact one (see ``quick_splat``). What is within ``distance`` m of the organ follows it in full, what is within
    ``band`` m more less and less.
    """

    def __init__(
        self,
        gaussians: Gaussians,
        body: Body,
        metres_per_unit: float,
        *,
        index: int = 0,
        device: str | None = None,
        once: bool = False,
        distance: float = 0.003,
        band: float = 0.003,
    ) -> None:
        self.gaussians, self._once = gaussians, once
        self._reach = {"distance": distance, "band": band}
        self._unit, self._index, self._device = metres_per_unit, index, device
        self._bound, self._binding = body.plain or body, self._bind(body)

    def _bind(self, body: Body) -> Follower:
        if self._once:
            return direct_splat(body, self.gaussians, self._unit, **self._reach)
        if self._device is None:
            return bind_splat(body, self.gaussians, self._unit, **self._reach)
        return quick_splat(body, self.gaussians, self._unit, device=self._device, **self._reach)

    def binding(self, moment: Snapshot) -> Follower:
        """How the Gaussians hang on the body of this moment."""
        body = moment.scene.bodies[self._index]
        plain = body.plain or body
        if plain.basis is not self._bound.basis:
            self._bound, self._binding = plain, self._bind(body)
        return self._binding

    def at(self, moment: Snapshot) -> Gaussians:
        """All Gaussians at a moment of the simulation."""
        body, z = moment.scene.bodies[self._index], moment.state.bodies[self._index].z
        return moved_splat(self.gaussians, self.binding(moment), body, z)

    def write(self, path: str | os.PathLike[str], moment: Snapshot) -> None:
        """That splat as a file that SuperSplat and gsplat read, atomically."""
        write_gaussians(Path(path), self.at(moment))


def frame_name(folder: str | os.PathLike[str], number: int) -> Path:
    """Where frame ``number`` of a sequence lies: splat_00000.ply and so on, as SuperSplat plays it back."""
    return Path(folder) / f"splat_{number:05d}.ply"
