"""The organ's surface as it is handed on: in the frame that is asked for, with colours if there are any."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..asset.registered_organ import RegisteredOrgan
from ..ground.checks import Array, one_of
from ..simulation.organ_body import metres_per_unit

FRAMES = {
    "scene": "splat file's axes, scene units",
    "ct": "CT axes RAS, mm (shape as registered, not as scanned)",
    "m": "splat file's axes, metres",
}


@dataclass(frozen=True)
class SurfaceMesh:
    """vertices (Nv, 3) in ``frame``, one of FRAMES; faces (Nf, 3) outward; colours (Nv, 3) uint8 or none."""

    vertices: Array
    faces: NDArray[np.int64]
    frame: str
    name: str = "organ"
    colours: NDArray[np.uint8] | None = None

    @property
    def comment(self) -> str:
        """One line on what the numbers are, for the files' headers."""
        return f"organphys: {' '.join(self.name.split())}; {FRAMES[self.frame]}"

    def coloured(self, colours: Array) -> SurfaceMesh:
        """With vertex colours (Nv, 3) in 0..1."""
        return replace(self, colours=(np.clip(colours, 0, 1) * 255 + 0.5).astype(np.uint8))


def surface_mesh(organ: RegisteredOrgan, *, frame: str = "scene", vertices_m: Array | None = None) -> SurfaceMesh:
    """The registered surface, or a simulated one of vertices (Nv, 3) in m of the simulation's scene."""
    scene = organ.scene_vertices if vertices_m is None else vertices_m / metres_per_unit(organ)
    return SurfaceMesh(in_frame(organ, scene, frame), organ.faces, frame, organ.name)


def in_frame(organ: RegisteredOrgan, points_scene: Array, frame: str) -> Array:
    """Points (N, 3) in scene units brought into ``frame``: "scene", "ct" by the inverse similarity, or "m"."""
    one_of(frame, "frame", tuple(FRAMES))
    if frame == "ct":
        return organ.T_scene_ct.inverse().apply(points_scene)
    return points_scene * (metres_per_unit(organ) if frame == "m" else 1.0)
