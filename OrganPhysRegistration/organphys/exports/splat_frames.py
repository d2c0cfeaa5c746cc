"""Frames of a moving splat as INRIA PLY files with stable rows: Gaussian i of the input is row i of every frame."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from ..points.gaussians import Gaussians
from ..simulation.body import Body
from ..simulation.moved_splat import moved_splat
from ..simulation.session import Snapshot
from ..simulation.splat_binding import SplatBinding
from .gaussian_ply import write_gaussians


@dataclass(frozen=True)
class FollowingSplat:
    """A splat bound to body number ``index`` of a scene; bound again when its pins, and so its basis, change."""

    gaussians: Gaussians
    binding: SplatBinding
    index: int = 0

    def at(self, moment: Snapshot) -> Gaussians:
        """All Gaussians at a moment of the simulation."""
        body: Body = moment.scene.bodies[self.index]
        return moved_splat(self.gaussians, self.binding, body, moment.state.bodies[self.index].z)

    def write(self, path: str | os.PathLike[str], moment: Snapshot) -> None:
        """That splat as a file that SuperSplat and gsplat read, atomically."""
        write_gaussians(Path(path), self.at(moment))


def frame_name(folder: str | os.PathLike[str], number: int) -> Path:
    """Where frame ``number`` of a sequence lies: splat_00000.ply and so on, as SuperSplat plays it back."""
    return Path(folder) / f"splat_{number:05d}.ply"
