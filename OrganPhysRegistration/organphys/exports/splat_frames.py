"""Frames of a moving splat as INRIA PLY files with stable rows: Gaussian i of the input is row i of every frame."""

from __future__ import annotations

import os
from pathlib import Path

from ..points.gaussians import Gaussians
from ..simulation.body import Body
from ..simulation.moved_splat import moved_splat
from ..simulation.session import Snapshot
from ..simulation.splat_binding import SplatBinding, bind_splat
from .gaussian_ply import write_gaussians


class FollowingSplat:
    """A splat that follows body number ``index`` of a scene, and is bound again when new pins give it a new basis."""

    def __init__(self, gaussians: Gaussians, body: Body, metres_per_unit: float, *, index: int = 0) -> None:
        self.gaussians = gaussians
        self._unit, self._index = metres_per_unit, index
        self._bound = body.plain or body
        self._binding = bind_splat(body, gaussians, metres_per_unit)

    def binding(self, moment: Snapshot) -> SplatBinding:
        """How the Gaussians hang on the body of this moment."""
        body = moment.scene.bodies[self._index]
        plain = body.plain or body
        if plain.basis is not self._bound.basis:
            self._bound, self._binding = plain, bind_splat(body, self.gaussians, self._unit)
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
